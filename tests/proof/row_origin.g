# One row of tri_test applied to the origin: o'k = nearest(row . o + offset), in the format row_position, ties up.
# Capitals are the real row of the triangle, small letters what its record holds; the origin is exact.
#: row row_origin | o'u, o'v, o'z: error
@narrow = fixed<-24,nu>;            #: format row_position
real = C1*o1 + C2*o2 + C3*o3 + K;
code = narrow(c1*o1 + c2*o2 + c3*o3 + k);
{ |c1 - C1| <= 1048577b-47 /\       #: half_ulp coefficient
  |c2 - C2| <= 1048577b-47 /\       #: half_ulp coefficient
  |c3 - C3| <= 1048577b-47 /\       #: half_ulp coefficient
  |k - K| <= 131073b-47 /\          #: half_ulp offset
  |o1| <= 1 /\ |o2| <= 1 /\ |o3| <= 1 /\
  |real| <= 3.4642 ->               # row norm below 1, both ends in [-1, 1]^3
  |code - real| <= 1825b-35 /\      #: proves row_origin
  |code| <= 3.465 /\                #: proves row_origin_range
  (real <= 0 -> code <= 0) }        #: proves row_origin_sign
