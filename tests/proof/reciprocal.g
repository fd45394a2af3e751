# ray_setup: R = min(floor(q), 2^26 - 1) with q = 2^52 / Dn, where Dn = |code of d| 2^e lies in [2^26, 2^27). Only Dn =
# 2^26 saturates: there q = 2^26. Either way R is below q by at most 1.
@floor = int<dn>;
q = 1b52 / Dn;
saturated = 67108863;               #: max reciprocal
{ Dn in [67108865, 134217727] ->
  floor(q) - q in [-1, 0] /\                         #: proves reciprocal
  floor(q) in [33554432, 67108863] /\                #: proves reciprocal_range; max reciprocal
  saturated - 1b52 / 67108864 in [-1, 0] }           #: proves reciprocal_saturated
