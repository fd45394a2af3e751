# W = DZ - U - Vs with DZ = floor(d'z 2^-eu) and Vs = floor(V 2^(ev-eu)), 50 fraction bits, against the same formula on
# the real rows. Write k = 2^(ev-eu) <= 1 and p = 2^-eu. In exact arithmetic W = o'w d'z - o'z d'w, o'w = p - o'u - k
# o'v, d'w = -(d'u + k d'v): the row w = -(u + k v), whose norm is (h_u / h_w) |u| <= 2. So (o'w, o'z) = R (2 xo, zo)
# and (d'w, d'z) = N (2 xd, zd) with (x, z) in the unit disc. The errors of rows u and v add up in row w; p is exact.
#: row edge_w | W: error
@align = fixed<-50,dn>;             #: format edge_sum
R = 3.4641016151377546;             # 2 sqrt 3, rounded up
N = 33554433b-25;                   # |d| <= 1 + 2^-25
Eo = 1825b-35;                      #: uses row_origin
Ed = 700b-35;                       #: uses row_direction
ow = 2*R*xo; oz = R*zo; dw = 2*N*xd; dz = N*zd;
p = ow + ou + k*ov;
du = -(dw + k*dv);
a = 2*aw - k*av;                    # |a|, |av| <= 1: errors of o'u, o'v; 2 aw is their sum in row w
e = 2*ew - k*ev;                    # likewise d'u, d'v
ouq = ou + Eo*a; ovq = ov + Eo*av; ozq = oz + Eo*c;
duq = du + Ed*e; dvq = dv + Ed*ev; dzq = dz + Ed*b;
U = ouq*dzq - ozq*duq;
V = ovq*dzq - ozq*dvq;
code = align(dzq*p) - U - align(V*k);
before = dzq*p - U - V*k;
real = dz*p - (ou*dz - oz*du) - (ov*dz - oz*dv)*k;
of_origin = xo*b + zo*ew;
of_direction = zd*aw + xd*c;
{ |of_origin| <= 1.4144 /\          #: uses disc_1
  |of_direction| <= 1.4144 /\       #: uses disc_1
  |aw| <= 1 /\ |b| <= 1 /\ |c| <= 1 /\ |ew| <= 1 /\
  |xo| <= 1 /\ |zo| <= 1 /\ |xd| <= 1 /\ |zd| <= 1 ->
  |code - real| <= 12026b-35 /\     #: proves edge_w
  |code| <= 32 /\                   #: proves edge_w_range
  (real >= 0 -> code >= -1b-21) }   #: proves edge_w_kept; contract eps_w
before - real -> 2*R*Ed*of_origin - 2*N*Eo*of_direction + 2*Eo*Ed*(c*ew - b*aw);
code - real -> (align(dzq*p) - dzq*p) - (align(V*k) - V*k) + (before - real);
real -> 2*R*N*(xo*zd - zo*xd);
