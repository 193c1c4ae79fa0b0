// A gravity dam on a block of rock: lengths in metres, y upwards, water on the left.
// The origin is the heel, the upstream edge of the joint. Change the numbers here; the lines below follow.
H = 40.0;            // height of the dam
B = 30.0;            // width of its base
crest = 5.0;         // width of its crest
water = 36.0;        // depth of the water at the upstream face
upstream = 40.0;     // rock in front of the heel
downstream = 40.0;   // rock behind the toe
depth = 30.0;        // of the rock in the mesh
size = 6.0;          // of the cells of the dam, which the case file divides into four each
far = 20.0;          // of the cells at the ends of the mesh

// The dam, a body of its own; a point of its upstream face is at the level of the water.
Point(1) = {0, 0, 0, size};
Point(2) = {B, 0, 0, size};
Point(3) = {crest, H, 0, size};
Point(4) = {0, H, 0, size};
Point(5) = {0, water, 0, size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 1};
Curve Loop(1) = {1, 2, 3, 4, 5};
Plane Surface(1) = {1};

// The rock has points of its own in the joint.
Point(11) = {0, 0, 0, size};
Point(12) = {B, 0, 0, size};
Point(13) = {B + downstream, 0, 0, far};
Point(14) = {B + downstream, -depth, 0, far};
Point(15) = {-upstream, -depth, 0, far};
Point(16) = {-upstream, 0, 0, far};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {13, 14};
Line(14) = {14, 15};
Line(15) = {15, 16};
Line(16) = {16, 11};
Curve Loop(2) = {11, 12, 13, 14, 15, 16};
Plane Surface(2) = {2};

// Both faces of the joint, and both ends of the rock, are divided alike: their nodes face one another.
Transfinite Curve {1, 11} = Ceil(B / size) + 1;
Transfinite Curve {13, 15} = Ceil(depth / far) + 1;

Physical Surface("dam") = {1};
Physical Surface("rock") = {2};
Physical Curve("dam_base") = {1};
Physical Curve("upstream_face") = {5};       // its wet part
Physical Curve("downstream_face") = {2};
Physical Curve("rock_joint") = {11};
Physical Curve("reservoir_floor") = {16};
Physical Curve("rock_bottom") = {14};
Physical Curve("left_side") = {15};
Physical Curve("right_side") = {13};
