# hit_finish: u = U 2^eu / d'z toward zero, 24 fraction bits (v alike), against the exact u in [0, 1] of the exact hit
# point. p = 2^eu >= 1/2. Saturation to [0, 1] can only bring the result nearer to the exact value.
#: row barycentric | u, v: error times d'z 2^-eu (a floor of 2^-24 comes on top)
@narrow = fixed<-24,zr>;            #: format barycentric
dz_code = dz + b;
code_edge = edge + e;
real = edge*p / dz;
quotient = code_edge*p / dz_code;
code = narrow(quotient);
{ |b| <= 700b-35 /\                 #: uses row_direction
  |e| <= 6013b-35 /\                #: uses edge_uv
  p >= 1b-1 /\ p <= 1b52 /\ dz in [1b-24, 1] /\ real in [0, 1] ->
  |code - quotient| <= 1b-24 /\                          #: proves barycentric_floor
  |(quotient - real) * (dz_code / p)| <= 7413b-35 }      #: proves barycentric
(quotient - real) * (dz_code / p) -> e - real*b/p { dz <> 0, dz_code <> 0, p <> 0 };
