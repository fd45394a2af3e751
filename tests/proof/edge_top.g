# The upper comparison of U (V alike): U - DZ with DZ = floor(d'z 2^-eu), 50 fraction bits, against the same formula on
# the real rows. p = 2^-eu <= 2 is exact, and is what row u gives at vertex 1. So o'u - p vanishes there, as o'z does,
# and (o'u - p, o'z) = R (xt, zo) with (xt, zo) in the unit disc, as (o'u, o'z) is in edge_uv.g with vertex 0: U - DZ is
# an edge function of its own, of the line through vertex 1 parallel to edge u. Symbols as in edge_uv.g.
#: row edge_top | U - DZ, V - DZ: error (the upper ends)
@align = fixed<-50,dn>;             #: format edge_sum
R = 3.4641016151377546;             # 2 sqrt 3, rounded up
N = 33554433b-25;                   # |d| <= 1 + 2^-25
Eo = 1825b-35;                      #: uses row_origin
Ed = 700b-35;                       #: uses row_direction
top = R*xt; oz = R*zo; du = N*xd; dz = N*zd;
ou = top + p;
ouq = ou + Eo*a; ozq = oz + Eo*c; duq = du + Ed*e; dzq = dz + Ed*b;
real = ou*dz - oz*du - dz*p;
one = align(dzq*p);
code = ouq*dzq - ozq*duq - one;
of_origin = xt*b - zo*e;
of_direction = zd*a - xd*c;
{ |of_origin| <= 1.4144 /\          #: uses disc_1
  |of_direction| <= 1.4144 /\       #: uses disc_1
  |a| <= 1 /\ |b| <= 1 /\ |c| <= 1 /\ |e| <= 1 /\ p in [0, 2] /\
  |xt| <= 1 /\ |zo| <= 1 /\ |xd| <= 1 /\ |zd| <= 1 ->
  |code - real| <= 6013b-35 /\      #: proves edge_top
  |one| <= 3 /\                     #: proves edge_top_range
  (real <= 0 -> code <= 1b-22) }    #: proves edge_top_kept; contract eps_uv
code - real -> R*Ed*of_origin + N*Eo*of_direction + Eo*Ed*(a*b - c*e) - (one - dzq*p);
