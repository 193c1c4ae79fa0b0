// Two towers of different height on one raft on soil: lengths in metres, y upwards.
// The origin is the left lower edge of the raft.
B = 24.0;            // width of the raft
raft = 1.5;          // its thickness
left = 4.0;          // where the tall tower begins
width = 6.0;         // of each tower
gap = 0.02;          // between them
tall = 18.0;         // heights above the raft
low = 12.0;
side = 24.0;         // soil beside the raft
depth = 12.0;        // of the soil, down to the rock
size = 1.5;          // of the cells of towers, raft and soil below it
far = 5.0;           // of the cells at the ends of the mesh

a = left + width;          // faces that look at one another
b = a + gap;
top = raft + tall;
roof = raft + low;

// Raft and towers are one body of three groups.
Point(1) = {0, 0, 0, size};
Point(2) = {B, 0, 0, size};
Point(3) = {B, raft, 0, size};
Point(4) = {b + width, raft, 0, size};
Point(5) = {b, raft, 0, 0.3};
Point(6) = {a, raft, 0, 0.3};
Point(7) = {left, raft, 0, size};
Point(8) = {0, raft, 0, size};
Point(9) = {b + width, roof, 0, size};
Point(10) = {b, roof, 0, size};
Point(11) = {a, roof, 0, size};
Point(12) = {a, top, 0, size};
Point(13) = {left, top, 0, size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};        // below the low tower
Line(5) = {5, 6};        // the floor of the gap
Line(6) = {6, 7};        // below the tall tower
Line(7) = {7, 8};
Line(8) = {8, 1};
Line(9) = {4, 9};
Line(10) = {9, 10};
Line(11) = {10, 5};      // the face of the low tower
Line(12) = {6, 11};      // the face of the tall tower that it may strike
Line(13) = {11, 12};
Line(14) = {12, 13};
Line(15) = {13, 7};
Curve Loop(1) = {1, 2, 3, 4, 5, 6, 7, 8};
Plane Surface(1) = {1};
Curve Loop(2) = {9, 10, 11, -4};
Plane Surface(2) = {2};
Curve Loop(3) = {12, 13, 14, 15, -6};
Plane Surface(3) = {3};

// The soil has points of its own under the raft.
Point(21) = {0, 0, 0, size};
Point(22) = {B, 0, 0, size};
Point(23) = {B + side, 0, 0, far};
Point(24) = {B + side, -depth, 0, far};
Point(25) = {-side, -depth, 0, far};
Point(26) = {-side, 0, 0, far};
Line(21) = {21, 22};
Line(22) = {22, 23};
Line(23) = {23, 24};
Line(24) = {24, 25};
Line(25) = {25, 26};
Line(26) = {26, 21};
Curve Loop(4) = {21, 22, 23, 24, 25, 26};
Plane Surface(4) = {-4};

// Faces that touch, and both ends of the soil, are divided alike.
Transfinite Curve {1, 21} = Ceil(B / size) + 1;
Transfinite Curve {11, 12} = Ceil(low / size) + 1;
Transfinite Curve {23, 25} = Ceil(depth / far) + 1;

Physical Surface("raft") = {1};
Physical Surface("low_tower") = {2};
Physical Surface("tall_tower") = {3};
Physical Surface("soil") = {4};
Physical Curve("raft_bottom") = {1};
Physical Curve("soil_under_raft") = {21};
Physical Curve("low_face") = {11};
Physical Curve("tall_face") = {12};
Physical Curve("rock") = {24};
Physical Curve("left_side") = {25};
Physical Curve("right_side") = {23};
