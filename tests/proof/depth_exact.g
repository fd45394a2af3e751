# t = floor(-o'z / d'z), 24 fraction bits, against the exact t of the triangle's plane along the quantised ray, in terms
# of the exact t and of the d'z that the divider used. a and b are the errors of -o'z = t d'z and of d'z.
#: row depth_exact | t: error times the computed d'z, exact t up to 2 sqrt 3 (a floor of 2^-24 comes on top)
@floor = fixed<-24,dn>;             #: format t
dz_code = dz + b;
quotient = (t*dz + a) / dz_code;
code = floor(quotient);
{ |a| <= 1825b-35 /\                #: uses row_origin
  |b| <= 700b-35 /\                 #: uses row_direction
  dz in [1b-24, 1] /\
  t in [0, 3.4642] ->               # 2 sqrt 3 / (1 - 2^-25)
  |code - quotient| <= 1b-24 /\                      #: proves depth_floor
  |(quotient - t) * dz_code| <= 4251b-35 }           #: proves depth_exact
(quotient - t) * dz_code -> a - t*b { dz_code <> 0 };
