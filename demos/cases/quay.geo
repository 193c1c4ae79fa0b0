// A quay of caissons: the sea on its left, drained fill on its right; lengths in metres, y upwards.
// The origin is the seaward lower edge of the caisson.
B = 8.0;             // width of the caisson
H = 11.0;            // its height, and that of the fill
water = 9.0;         // depth of the sea
sea = 18.0;          // ground in front of the caisson
land = 20.0;         // ground and fill behind it
depth = 8.0;         // of the ground, down to the rock
size = 1.0;          // of the cells at the caisson
far = 3.5;           // of the cells at the ends of the mesh

// The caisson; a point of its face is at the level of the sea.
Point(1) = {0, 0, 0, size};
Point(2) = {B, 0, 0, size};
Point(3) = {B, H, 0, size};
Point(4) = {0, H, 0, size};
Point(5) = {0, water, 0, size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 1};
Curve Loop(1) = {1, 2, 3, 4, 5};
Plane Surface(1) = {1};

// Ground and fill are one body of two materials, with points of its own on the faces of the caisson.
Point(11) = {0, 0, 0, size};
Point(12) = {B, 0, 0, size};
Point(13) = {B, H, 0, size};
Point(14) = {B + land, H, 0, far};
Point(15) = {B + land, 0, 0, far};
Point(16) = {B + land, -depth, 0, far};
Point(17) = {-sea, -depth, 0, far};
Point(18) = {-sea, 0, 0, far};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {13, 14};
Line(14) = {14, 15};
Line(15) = {15, 12};     // between fill and ground
Line(16) = {15, 16};
Line(17) = {16, 17};
Line(18) = {17, 18};
Line(19) = {18, 11};
Curve Loop(2) = {12, 13, 14, 15};
Plane Surface(2) = {-2};
Curve Loop(3) = {11, -15, 16, 17, 18, 19};
Plane Surface(3) = {-3};

// Faces that touch are divided alike.
Transfinite Curve {1, 11} = Ceil(B / size) + 1;
Transfinite Curve {2, 12} = Ceil(H / size) + 1;

Physical Surface("caisson") = {1};
Physical Surface("fill") = {2};
Physical Surface("ground") = {3};
Physical Curve("caisson_base") = {1};
Physical Curve("caisson_back") = {2};
Physical Curve("wet_face") = {5};
Physical Curve("ground_base") = {11};
Physical Curve("fill_back") = {12};
Physical Curve("sea_bed") = {19};
Physical Curve("rock") = {17};
Physical Curve("left_side") = {18};
Physical Curve("right_side") = {14, 16};
