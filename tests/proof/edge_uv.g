# The edge function U = o'u d'z - o'z d'u (V alike) against the same formula on the real rows. (o'u, o'z) = R (xo, zo)
# and (d'u, d'z) = N (xd, zd) with (x, z) in the unit disc, because row u is orthogonal to row n and both norms are
# below 1. Errors of the rows: Eo a, Eo c on the origin, Ed b, Ed e on the direction, |a|, |b|, |c|, |e| <= 1.
#: row edge_uv | U, V: error
R = 3.4641016151377546;             # 2 sqrt 3, rounded up
N = 33554433b-25;                   # |d| <= 1 + 2^-25
Eo = 1825b-35;                      #: uses row_origin
Ed = 700b-35;                       #: uses row_direction
ou = R*xo; oz = R*zo; du = N*xd; dz = N*zd;
ouq = ou + Eo*a; ozq = oz + Eo*c; duq = du + Ed*e; dzq = dz + Ed*b;
real = ou*dz - oz*du;
code = ouq*dzq - ozq*duq;
of_origin = xo*b - zo*e;
of_direction = zd*a - xd*c;
{ |of_origin| <= 1.4144 /\          #: uses disc_1
  |of_direction| <= 1.4144 /\       #: uses disc_1
  |a| <= 1 /\ |b| <= 1 /\ |c| <= 1 /\ |e| <= 1 /\
  |xo| <= 1 /\ |zo| <= 1 /\ |xd| <= 1 /\ |zd| <= 1 ->
  |code - real| <= 6013b-35 /\      #: proves edge_uv
  |code| <= 8 /\                    #: proves edge_uv_range
  (real >= 0 -> code >= -1b-22) }   #: proves edge_uv_kept; contract eps_uv
code - real -> R*Ed*of_origin + N*Eo*of_direction + Eo*Ed*(a*b - c*e);
