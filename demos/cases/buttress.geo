// A buttress of a dam on rigid rock: lengths in metres, y upwards, water on the left.
// The origin is the heel.
H = 25.0;            // height of the buttress
B = 28.0;            // width of its base
face = 10.0;         // how far the upstream face leans back over its height
crest = 3.0;         // width of the crest
water = 23.0;        // depth of the water
head = 4.0;          // width of the base below the head, where water gets under it
size = 3.0;          // of the cells

Point(1) = {0, 0, 0, size};
Point(2) = {head, 0, 0, size};
Point(3) = {B, 0, 0, size};
Point(4) = {face + crest, H, 0, size};
Point(5) = {face, H, 0, size};
Point(6) = {face * water / H, water, 0, size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 1};
Curve Loop(1) = {1, 2, 3, 4, 5, 6};
Plane Surface(1) = {1};

Physical Surface("buttress") = {1};
Physical Curve("base") = {1, 2};
Physical Curve("head_base") = {1};
Physical Curve("wet_face") = {6};
