# A row of an instance, in units of 2^e: coefficients and constant are rounded once each; w is a point of the world.
#: row instance_row | instance record: error of a row at a point of the world, in units of 2^exponent
{ |e1| <= 32769b-47 /\              #: half_ulp instance_coefficient
  |e2| <= 32769b-47 /\              #: half_ulp instance_coefficient
  |e3| <= 32769b-47 /\              #: half_ulp instance_coefficient
  |e0| <= 32769b-47 /\              #: half_ulp instance_offset
  w1 in [-1, 1] /\ w2 in [-1, 1] /\ w3 in [-1, 1]
  -> |e1 * w1 + e2 * w2 + e3 * w3 + e0| <= 131076b-47 }  #: proves instance_row
