# How far beyond vertex 1 (2 for V) an accepted hit can lie: real / (nu L) is the signed distance of the exact hit point
# from the line through that vertex parallel to edge u, away from the edge, times the cosine between ray and normal.
# Symbols as in edge_top.g, with the norm kept apart as in false_uv.g; the floor of DZ adds at most 2^-50.
#: row false_top | accepted hit: distance beyond the vertex opposite to edge u or v, times the cosine
R = 3.4641016151377546;             # 2 sqrt 3, rounded up
N = 33554433b-25;                   # |d| <= 1 + 2^-25
Eo = 1825b-35;                      #: uses row_origin
Ed = 700b-35;                       #: uses row_direction
top = R*nu*xt; oz = R*zo; du = N*nu*xd; dz = N*zd;
real = top*dz - oz*du;
# the row errors are Ed e and Eo a with |e|, |a| <= 1 and 1/nu <= 2.000001: e = 2.000001 nu e2, a = 2.000001 nu a2
of_origin = xt*b + zo*(-e2)*2.000001;
of_direction = xd*(-c) + zd*a2*2.000001;
beyond = real / (nu * L);
excess = R*Ed*of_origin + N*Eo*of_direction + Eo*Ed*(a2*b - c*e2)*2.000001;
code = real + nu*excess + floors;
{ |of_origin| <= 2.2363 /\          #: uses disc_2
  |of_direction| <= 2.2363 /\       #: uses disc_2
  |a2| <= 1 /\ |b| <= 1 /\ |c| <= 1 /\ |e2| <= 1 /\ |floors| <= 1b-50 /\
  nu in [0.49999988, 1] /\ L in [0.9999997, 1.0000001] /\
  code in [-32, 1b-22] ->           #: contract eps_uv
  beyond <= 25890b-35 }             #: proves false_top
beyond -> ((code - floors) / nu - excess) / L { nu <> 0, L <> 0 };
