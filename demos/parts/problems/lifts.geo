// An L-shaped retaining wall whose backfill is placed in 6 layers, which lifts join: lengths in metres, y upwards.
// The origin is the tip of the toe, at founding level. Change the numbers here; the lines below follow.
H = 6.0;             // height of the wall, from founding level to the top of the stem and of the backfill
B = 4.0;             // width of the base slab
toe = 1.0;           // width of the toe, in front of the stem
stem = 0.5;          // thickness of the stem
slab = 0.6;          // thickness of the base slab
front = 8.0;         // ground in front of the toe
back = 10.0;         // ground behind the heel
depth = 5.0;         // of the soil below founding level, down to the rock
DefineConstant[ size = 0.9 ];   // of the cells at the wall
far = 3 * size / 0.9;            // of the cells at the ends of the mesh

heel = toe + stem;   // where the top of the heel begins, behind the stem
rise = (H - slab) / 6;
cells = Ceil(rise / size);

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

// The ground has points of its own below the wall, and shares those below the backfill.
Point(11) = {0, 0, 0, size};
Point(12) = {B, 0, 0, size};
Point(17) = {B + back, 0, 0, far};
Point(18) = {B + back, -depth, 0, far};
Point(19) = {-front, -depth, 0, far};
Point(20) = {-front, 0, 0, far};
Line(11) = {11, 12};
Line(17) = {17, 12};
Line(18) = {17, 18};
Line(19) = {18, 19};
Line(20) = {19, 20};
Line(21) = {20, 11};
Curve Loop(3) = {11, -17, 18, 19, 20, 21};
Plane Surface(3) = {3};

// The first lift reaches down to the ground behind the heel; the others lie on one another.
Point(13) = {B, slab, 0, size};
Point(14) = {heel, slab, 0, size};
Line(12) = {12, 13};
Line(13) = {13, 14};
Point(101) = {heel, slab + 1 * rise, 0, size};
Point(201) = {B + back, slab + 1 * rise, 0, far};
Line(301) = {14, 101};
Line(401) = {17, 201};
Line(501) = {101, 201};
Curve Loop(101) = {12, 13, 301, 501, -401, 17};
Plane Surface(101) = {101};
Point(102) = {heel, slab + 2 * rise, 0, size};
Point(202) = {B + back, slab + 2 * rise, 0, far};
Line(302) = {101, 102};
Line(402) = {201, 202};
Line(502) = {102, 202};
Curve Loop(102) = {-501, 302, 502, -402};
Plane Surface(102) = {102};
Point(103) = {heel, slab + 3 * rise, 0, size};
Point(203) = {B + back, slab + 3 * rise, 0, far};
Line(303) = {102, 103};
Line(403) = {202, 203};
Line(503) = {103, 203};
Curve Loop(103) = {-502, 303, 503, -403};
Plane Surface(103) = {103};
Point(104) = {heel, slab + 4 * rise, 0, size};
Point(204) = {B + back, slab + 4 * rise, 0, far};
Line(304) = {103, 104};
Line(404) = {203, 204};
Line(504) = {104, 204};
Curve Loop(104) = {-503, 304, 504, -404};
Plane Surface(104) = {104};
Point(105) = {heel, slab + 5 * rise, 0, size};
Point(205) = {B + back, slab + 5 * rise, 0, far};
Line(305) = {104, 105};
Line(405) = {204, 205};
Line(505) = {105, 205};
Curve Loop(105) = {-504, 305, 505, -405};
Plane Surface(105) = {105};
Point(106) = {heel, slab + 6 * rise, 0, size};
Point(206) = {B + back, slab + 6 * rise, 0, far};
Line(306) = {105, 106};
Line(406) = {205, 206};
Line(506) = {106, 206};
Curve Loop(106) = {-505, 306, 506, -406};
Plane Surface(106) = {106};

// Faces that touch are divided alike, so that every node has one that faces it.
Transfinite Curve {1, 11} = Ceil(B / size) + 1;
Transfinite Curve {2, 12} = Ceil(slab / size) + 1;
Transfinite Curve {3, 13} = Ceil((B - heel) / size) + 1;
Transfinite Curve {4} = 6 * cells + 1;
Transfinite Curve {301, 302, 303, 304, 305, 306} = cells + 1;

Physical Surface("wall") = {1};
Physical Surface("ground") = {3};
Physical Surface("fill_1") = {101};
Physical Surface("fill_2") = {102};
Physical Surface("fill_3") = {103};
Physical Surface("fill_4") = {104};
Physical Surface("fill_5") = {105};
Physical Surface("fill_6") = {106};
Physical Curve("base_bottom") = {1};
Physical Curve("heel_end") = {2};
Physical Curve("heel_top") = {3};
Physical Curve("stem_back") = {4};
Physical Curve("ground_base") = {11};
Physical Curve("fill_end") = {12};
Physical Curve("fill_heel") = {13};
Physical Curve("fill_stem") = {301, 302, 303, 304, 305, 306};
Physical Curve("rock") = {19};
Physical Curve("left_side") = {20};
Physical Curve("right_side") = {18, 401, 402, 403, 404, 405, 406};
