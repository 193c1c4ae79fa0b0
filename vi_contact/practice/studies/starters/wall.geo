// An L-shaped retaining wall with its backfill, on soil: lengths in metres, y upwards.
// The origin is the tip of the toe, at founding level. Change the numbers here; the lines below follow.
H = 6.0;             // height of the wall, from founding level to the top of the stem and of the backfill
B = 4.0;             // width of the base slab
toe = 1.0;           // width of the toe, in front of the stem
stem = 0.5;          // thickness of the stem
slab = 0.6;          // thickness of the base slab
front = 10.0;        // ground in front of the toe
back = 16.0;         // ground behind the heel
depth = 6.0;         // of the soil below founding level, down to the rock
size = 1.2;          // of the cells at the wall, which the case file divides into four each
far = 5.0;           // of the cells at the ends of the mesh

heel = toe + stem;   // where the top of the heel begins, behind the stem

// The wall, a body of its own: eight points, from the tip of the toe anticlockwise.
Point(1) = {0, 0, 0, size};
Point(2) = {B, 0, 0, size};
Point(3) = {B, slab, 0, size};
Point(4) = {heel, slab, 0, size};
Point(5) = {heel, H, 0, size};
Point(6) = {toe, H, 0, size};
Point(7) = {toe, slab, 0, size};
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

// The soil has points of its own on the faces of the wall: two bodies that touch.
Point(11) = {0, 0, 0, size};
Point(12) = {B, 0, 0, size};
Point(13) = {B, slab, 0, size};
Point(14) = {heel, slab, 0, size};
Point(15) = {heel, H, 0, size};
Point(16) = {B + back, H, 0, far};
Point(17) = {B + back, 0, 0, far};
Point(18) = {B + back, -depth, 0, far};
Point(19) = {-front, -depth, 0, far};
Point(20) = {-front, 0, 0, far};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {13, 14};
Line(14) = {14, 15};
Line(15) = {15, 16};
Line(16) = {16, 17};
Line(17) = {17, 12};     // between backfill and ground: one body, two materials
Line(18) = {17, 18};
Line(19) = {18, 19};
Line(20) = {19, 20};
Line(21) = {20, 11};
Curve Loop(2) = {12, 13, 14, 15, 16, 17};
Plane Surface(2) = {2};
Curve Loop(3) = {11, -17, 18, 19, 20, 21};
Plane Surface(3) = {3};

// Faces that touch are divided alike, so that every node has one that faces it.
Transfinite Curve {1, 11} = Ceil(B / size) + 1;
Transfinite Curve {2, 12} = Ceil(slab / size) + 1;
Transfinite Curve {3, 13} = Ceil((B - heel) / size) + 1;
Transfinite Curve {4, 14} = Ceil((H - slab) / size) + 1;

Physical Surface("wall") = {1};
Physical Surface("backfill") = {2};
Physical Surface("ground") = {3};
// Every face has a group of its own: in one group round a corner the corner would have a mean normal.
Physical Curve("base_bottom") = {1};
Physical Curve("heel_end") = {2};
Physical Curve("heel_top") = {3};
Physical Curve("stem_back") = {4};
Physical Curve("ground_base") = {11};
Physical Curve("backfill_end") = {12};
Physical Curve("backfill_heel") = {13};
Physical Curve("backfill_stem") = {14};
Physical Curve("rock") = {19};
Physical Curve("left_side") = {20};
Physical Curve("right_side") = {16, 18};
