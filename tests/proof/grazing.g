# What tri_test decides before it looks at the edges, for rays that are not grazing: |real d'z| >= 2^-24. Rows are taken
# with the sign that makes the real d'z positive; then o'z = -t d'z at the exact plane, t >= 0.
dz_code = dz + b;
quotient = (t*dz + a) / dz_code;    # -o'z / d'z as the divider sees it
{ @FIX(dz_code, -26) /\             #: lsb row_direction
  |a| <= 1825b-35 /\                #: uses row_origin
  |b| <= 700b-35 /\                 #: uses row_direction
  dz in [1b-24, 1] /\
  t in [0, 3.4642] ->               # 2 sqrt 3 / (1 - 2^-25)
  dz_code >= 3b-26 /\               #: proves grazing_sign
  quotient <= 7 }                   #: proves grazing_range
quotient -> (t + a/dz) / (1 + b/dz) { dz <> 0, dz_code <> 0 };
