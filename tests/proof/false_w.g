# How far outside edge w an accepted hit can lie. Row w has norm nu, 1/2 <= |u| <= nu <= 2 (up to 2^-22), because h_w <=
# h_u <= 2 h_w. real / (nu L), L = (1 - 2^-22) |d|, is the signed distance of the exact hit point from the edge line in
# the triangle's plane, times the cosine between ray and normal. Symbols as in edge_w.g; the two floors together add
# less than 2^-50.
#: row false_w | accepted hit: distance outside edge w, times the cosine
R = 3.4641016151377546;             # 2 sqrt 3, rounded up
N = 33554433b-25;                   # |d| <= 1 + 2^-25
Eo = 1825b-35;                      #: uses row_origin
Ed = 700b-35;                       #: uses row_direction
ow = R*nu*xo; oz = R*zo; dw = N*nu*xd; dz = N*zd;
real = ow*dz - oz*dw;
# the sums of two row errors are 2 ew and 2 aw, |ew|, |aw| <= 1; ew = 2.000001 nu e2, aw = 2.000001 nu a2
of_origin = xo*b + zo*e2*4.000002;
of_direction = xd*c + zd*a2*4.000002;
outside = -real / (nu * L);
excess = R*Ed*of_origin - N*Eo*of_direction + Eo*Ed*(c*e2 - b*a2)*4.000002;
code = real + nu*excess + floors;
{ |of_origin| <= 4.1234 /\          #: uses disc_4
  |of_direction| <= 4.1234 /\       #: uses disc_4
  |a2| <= 1 /\ |b| <= 1 /\ |c| <= 1 /\ |e2| <= 1 /\ |floors| <= 1b-50 /\
  nu in [0.49999988, 2] /\ L in [0.9999997, 1.0000001] /\
  code in [-1b-21, 32] ->           #: contract eps_w
  outside <= 50296b-35 }            #: proves false_w
outside -> (excess - (code - floors) / nu) / L { nu <> 0, L <> 0 };
