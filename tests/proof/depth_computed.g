# The same error in terms of the computed quotient and of the exact cosine |normal . d| = d'z / (1 - 2^-22): what a
# comparison with the golden model knows. o'z_code = quotient dz_code is what the divider saw, so the exact t d'z is
# quotient dz_code - a.
#: row depth_computed | t: error times the exact cosine, computed t up to 2 sqrt 3 (a floor of 2^-24 comes on top)
sigma = 4194303b-22;                # norm of row n
dz = sigma*cosine;
dz_code = dz + b;
t = (quotient*dz_code - a) / dz;
{ |a| <= 1825b-35 /\                #: uses row_origin
  |b| <= 700b-35 /\                 #: uses row_direction
  cosine in [1b-24, 1] /\
  quotient in [0, 3.465] ->
  |(quotient - t) * cosine| <= 4252b-35 }            #: proves depth_computed
(quotient - t) * cosine -> (a - quotient*b) / sigma { dz <> 0 };
