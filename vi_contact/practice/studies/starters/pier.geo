// A bridge pier that carries its deck, on a raft on soil: lengths in metres, y upwards.
// The origin is the middle of the underside of the raft. Change the numbers here; the lines below follow.
B = 7.0;             // width of the raft
raft = 1.5;          // thickness of the raft
pier = 2.0;          // width of the pier
L = 9.0;             // height of the pier, from the raft to the deck
deck = 6.0;          // width of the deck
box = 1.5;           // height of the deck
far_side = 14.0;     // soil beside the raft
depth = 8.0;         // of the soil, down to the rock
size = 1.0;          // of the cells at the raft, which the case file divides into four each
tall = 2.0;          // of the cells of pier and deck
far = 4.0;           // of the cells at the ends of the mesh

// Raft, pier and deck are one body.
Point(1) = {-B / 2, 0, 0, size};
Point(2) = {B / 2, 0, 0, size};
Point(3) = {B / 2, raft, 0, size};
Point(4) = {pier / 2, raft, 0, tall};
Point(5) = {pier / 2, raft + L, 0, tall};
Point(6) = {deck / 2, raft + L, 0, tall};
Point(7) = {deck / 2, raft + L + box, 0, tall};
Point(8) = {-deck / 2, raft + L + box, 0, tall};
Point(9) = {-deck / 2, raft + L, 0, tall};
Point(10) = {-pier / 2, raft + L, 0, tall};
Point(11) = {-pier / 2, raft, 0, tall};
Point(12) = {-B / 2, raft, 0, size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 7};
Line(7) = {7, 8};
Line(8) = {8, 9};
Line(9) = {9, 10};
Line(10) = {10, 11};
Line(11) = {11, 12};
Line(12) = {12, 1};
Line(13) = {4, 11};      // between raft and pier
Line(14) = {5, 10};      // between pier and deck
Curve Loop(1) = {1, 2, 3, 13, 11, 12};
Plane Surface(1) = {1};
Curve Loop(2) = {4, 14, 10, -13};
Plane Surface(2) = {2};
Curve Loop(3) = {5, 6, 7, 8, 9, -14};
Plane Surface(3) = {3};

// The soil has points of its own under the raft.
Point(21) = {-B / 2, 0, 0, size};
Point(22) = {B / 2, 0, 0, size};
Point(23) = {B / 2 + far_side, 0, 0, far};
Point(24) = {B / 2 + far_side, -depth, 0, far};
Point(25) = {-B / 2 - far_side, -depth, 0, far};
Point(26) = {-B / 2 - far_side, 0, 0, far};
Line(21) = {21, 22};
Line(22) = {22, 23};
Line(23) = {23, 24};
Line(24) = {24, 25};
Line(25) = {25, 26};
Line(26) = {26, 21};
Curve Loop(4) = {21, 22, 23, 24, 25, 26};
Plane Surface(4) = {4};

// Raft and soil under it, and both ends of the soil, are divided alike: their nodes face one another.
Transfinite Curve {1, 21} = Ceil(B / size) + 1;
Transfinite Curve {23, 25} = Ceil(depth / far) + 1;

Physical Surface("raft") = {1};
Physical Surface("pier") = {2};
Physical Surface("deck") = {3};
Physical Surface("soil") = {4};
Physical Curve("raft_bottom") = {1};
Physical Curve("soil_under_raft") = {21};
Physical Curve("rock") = {24};
Physical Curve("left_side") = {25};
Physical Curve("right_side") = {23};
