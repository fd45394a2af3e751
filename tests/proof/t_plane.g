# t_plane of kd_descend and leaf_exit, for one axis with direction d <> 0, against t = (s - o) / d. x = s - o with the
# sign of d. R and q as in reciprocal.g, r = R - q; sh = 26 - e and p = 2^-sh, so that 1 / |d| = q p. t_plane = floor(x
# R p), 24 fraction bits, before it saturates.
#: row t_plane_relative | 1/d: relative error
#: row t_plane_floor | t_plane: floor
#: row t_plane_position | t_plane: error in position along the axis
@floor = fixed<-24,dn>;             #: format t
R = q + r;
d = 1 / (q*p);
real = x*q*p;
code = floor(x*R*p);
{ r in [-1, 0] /\                   #: uses reciprocal; uses reciprocal_saturated
  q in [33554432, 67108864] /\       # 2^52 / Dn
  p in [1b-26, 1] /\
  |x| <= 2 ->
  |r / q| <= 1b-25 /\                                #: proves t_plane_relative
  |code - x*R*p| <= 1b-24 /\                         #: proves t_plane_floor
  (d <= 1 -> |(code - real) * d| <= 1b-23) /\        #: proves t_plane_position
  (x in [0, 2] -> code - real <= 0) }                #: proves t_plane_early
(code - real) * d -> (code - x*R*p) * d + x * (r / q) { p <> 0, q <> 0 };
code - real -> (code - x*R*p) + x*r*p;
