// A cantilever retaining wall whose fill is on its left: lengths in metres, y upwards.
// The origin is the end of the heel, at founding level; the toe is on the right.
H = 7.5;             // height of the wall, from founding level to its top and that of the fill
B = 5.0;             // width of the base slab
toe = 1.2;           // width of the toe, in front of the stem
stem = 0.7;          // thickness of the stem
slab = 0.8;          // thickness of the base slab
front = 12.0;        // ground in front of the toe
back = 20.0;         // ground behind the heel
depth = 7.0;         // of the soil below founding level, down to the rock
size = 0.8;          // of the cells at the wall
far = 3.0;           // of the cells at the ends of the mesh

behind = B - toe - stem;   // where the stem begins

// The wall, a body of its own, from the end of the heel anticlockwise.
Point(1) = {0, 0, 0, size};
Point(2) = {B, 0, 0, size};
Point(3) = {B, slab, 0, size};
Point(4) = {behind + stem, slab, 0, size};
Point(5) = {behind + stem, H, 0, size};
Point(6) = {behind, H, 0, size};
Point(7) = {behind, slab, 0, size};
Point(8) = {0, slab, 0, size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 7};
Line(7) = {7, 8};
Line(8) = {8, 1};
Curve Loop(1) = {1, 2, 3, 4, 5, 6, 7, 8};
Plane Surface(1) = {1};

// The soil has points of its own on the faces of the wall.
Point(11) = {0, 0, 0, size};
Point(12) = {B, 0, 0, size};
Point(13) = {0, slab, 0, size};
Point(14) = {behind, slab, 0, size};
Point(15) = {behind, H, 0, size};
Point(16) = {-back, H, 0, far};
Point(17) = {-back, 0, 0, far};
Point(18) = {-back, -depth, 0, far};
Point(19) = {B + front, -depth, 0, far};
Point(20) = {B + front, 0, 0, far};
Line(11) = {11, 12};
Line(12) = {11, 13};
Line(13) = {13, 14};
Line(14) = {14, 15};
Line(15) = {15, 16};
Line(16) = {16, 17};
Line(17) = {17, 11};     // between fill and ground: one body, two materials
Line(18) = {17, 18};
Line(19) = {18, 19};
Line(20) = {19, 20};
Line(21) = {20, 12};
Curve Loop(2) = {12, 13, 14, 15, 16, 17};
Plane Surface(2) = {2};
Curve Loop(3) = {17, 11, -21, -20, -19, -18};
Plane Surface(3) = {3};

// Faces that touch are divided alike, so that every node has one that faces it.
Transfinite Curve {1, 11} = Ceil(B / size) + 1;
Transfinite Curve {8, 12} = Ceil(slab / size) + 1;
Transfinite Curve {7, 13} = Ceil(behind / size) + 1;
Transfinite Curve {6, 14} = Ceil((H - slab) / size) + 1;

Physical Surface("wall") = {1};
Physical Surface("fill") = {2};
Physical Surface("ground") = {3};
Physical Curve("base_bottom") = {1};
Physical Curve("heel_end") = {8};
Physical Curve("heel_top") = {7};
Physical Curve("stem_back") = {6};
Physical Curve("ground_base") = {11};
Physical Curve("fill_end") = {12};
Physical Curve("fill_heel") = {13};
Physical Curve("fill_stem") = {14};
Physical Curve("fill_top") = {15};
Physical Curve("rock") = {19};
Physical Curve("left_side") = {16, 18};
Physical Curve("right_side") = {20};
