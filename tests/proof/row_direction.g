# One row of tri_test applied to the direction: d'k = nearest(row . d), in the format row_direction, ties up.
# Coefficient errors are Ec e_i and the direction N d_i, with |e_i| <= 1 and (d_1, d_2, d_3) in the unit ball.
#: row row_direction | d'u, d'v, d'z: error
@narrow = fixed<-26,nu>;            #: format row_direction
N = 33554433b-25;                   # |d| <= 1 + 2^-25
Ec = 1048577b-47;                   #: half_ulp coefficient
error = e1*d1 + e2*d2 + e3*d3;
before = real + Ec*N*error;
code = narrow(before);
{ |error| <= 1.7325 /\              #: uses ball
  |real| <= 0.9999998 ->            # (1 - 2^-22)(1 + 2^-25)
  |code - real| <= 700b-35 /\       #: proves row_direction
  |code| <= 67108863b-26 }          #: proves row_direction_range
before - real -> Ec*N*error;
