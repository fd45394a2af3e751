# How far outside edge u (v alike) an accepted hit can lie. The row has norm nu, 1/2 <= nu < 1 (up to 2^-22). real / (nu
# L), L = (1 - 2^-22) |d|, is the signed distance of the exact hit point from the edge line in the triangle's plane,
# times the cosine between ray and normal. Symbols as in edge_uv.g, with the norm kept apart.
#: row false_uv | accepted hit: distance outside edge u or v, times the cosine
R = 3.4641016151377546;             # 2 sqrt 3, rounded up
N = 33554433b-25;                   # |d| <= 1 + 2^-25
Eo = 1825b-35;                      #: uses row_origin
Ed = 700b-35;                       #: uses row_direction
e = 2.000001*nu*e2;                 # |e|, |a| <= 1 and 1/nu <= 2.000001, hence |e2|, |a2| <= 1
a = 2.000001*nu*a2;
ou = R*nu*xo; oz = R*zo; du = N*nu*xd; dz = N*zd;
ouq = ou + Eo*a; ozq = oz + Eo*c; duq = du + Ed*e; dzq = dz + Ed*b;
real = ou*dz - oz*du;
code = ouq*dzq - ozq*duq;
of_origin = xo*b + zo*(-e2)*2.000001;
of_direction = xd*(-c) + zd*a2*2.000001;
outside = -real / (nu * L);
excess = R*Ed*of_origin + N*Eo*of_direction + Eo*Ed*(a2*b - c*e2)*2.000001;    # (code - real) / nu
{ |of_origin| <= 2.2363 /\          #: uses disc_2
  |of_direction| <= 2.2363 /\       #: uses disc_2
  |a2| <= 1 /\ |b| <= 1 /\ |c| <= 1 /\ |e2| <= 1 /\
  nu in [0.49999988, 1] /\ L in [0.9999997, 1.0000001] /\
  code in [-1b-22, 8] ->            #: contract eps_uv
  outside <= 25890b-35 }            #: proves false_uv
outside -> (excess - code / nu) / L { nu <> 0, L <> 0 };
