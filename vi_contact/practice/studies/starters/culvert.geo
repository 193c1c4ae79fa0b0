// A box culvert in a layer of soil on rock: lengths in metres, y upwards.
// The origin is on the surface of the ground, above the middle of the box. Change the numbers here; the lines below follow.
W = 6.0;             // width of the box, outside
H = 4.0;             // height of the box, outside
t = 0.5;             // thickness of roof, walls and floor
cover = 5.0;         // soil above the roof
depth = 16.0;        // of the soil, down to the rock
far_side = 24.0;     // soil beside the box
size = 1.0;          // of the cells of the box and round it, which the case file divides into four each
far = 4.4;           // of the cells at the ends of the mesh

top = -cover;
bottom = -cover - H;
w = W / 2;

// The box, a body of its own with a hole: four points outside, four inside.
Point(1) = {-w, bottom, 0, size};
Point(2) = {w, bottom, 0, size};
Point(3) = {w, top, 0, size};
Point(4) = {-w, top, 0, size};
Point(5) = {-w + t, bottom + t, 0, size};
Point(6) = {w - t, bottom + t, 0, size};
Point(7) = {w - t, top - t, 0, size};
Point(8) = {-w + t, top - t, 0, size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Line(5) = {5, 6};
Line(6) = {6, 7};
Line(7) = {7, 8};
Line(8) = {8, 5};
Curve Loop(1) = {1, 2, 3, 4};
Curve Loop(2) = {5, 6, 7, 8};
Plane Surface(1) = {1, 2};

// The soil has points of its own round the box.
Point(11) = {-w, bottom, 0, size};
Point(12) = {w, bottom, 0, size};
Point(13) = {w, top, 0, size};
Point(14) = {-w, top, 0, size};
Point(15) = {-w - far_side, -depth, 0, far};
Point(16) = {w + far_side, -depth, 0, far};
Point(17) = {w + far_side, 0, 0, far};
Point(18) = {-w - far_side, 0, 0, far};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {13, 14};
Line(14) = {14, 11};
Line(15) = {15, 16};
Line(16) = {16, 17};
Line(17) = {17, 18};
Line(18) = {18, 15};
Curve Loop(3) = {11, 12, 13, 14};
Curve Loop(4) = {15, 16, 17, 18};
Plane Surface(2) = {4, 3};

// Four points of the free field, as deep as the corners of the box: nodes at which its racking is recorded.
free = 20.0;         // their distance from the middle of the box, to the nearer ones
Point(21) = {free, bottom, 0, far};
Point(22) = {free + 4, bottom, 0, far};
Point(23) = {free + 4, top, 0, far};
Point(24) = {free, top, 0, far};
Point {21, 22, 23, 24} In Surface {2};

// Faces that touch, and both ends of the soil, are divided alike: their nodes face one another.
Transfinite Curve {1, 3, 11, 13} = Ceil(W / size) + 1;
Transfinite Curve {2, 4, 12, 14} = Ceil(H / size) + 1;
Transfinite Curve {16, 18} = Ceil(depth / far) + 1;

Physical Surface("box") = {1};
Physical Surface("soil") = {2};
// Every face has a group of its own: in one group round a corner the corners would have mean normals.
Physical Curve("box_floor") = {1};
Physical Curve("box_right") = {2};
Physical Curve("box_roof") = {3};
Physical Curve("box_left") = {4};
Physical Curve("soil_floor") = {11};
Physical Curve("soil_right") = {12};
Physical Curve("soil_roof") = {13};
Physical Curve("soil_left") = {14};
Physical Curve("rock") = {15};
Physical Curve("right_side") = {16};
Physical Curve("left_side") = {18};
