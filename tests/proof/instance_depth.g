# Depth in an object, t up to 7: |o'z| / |d'z| differs from t by (a - t b) / d'z, with the errors a and b of the row n.
#: row instance_depth | t in an object: error times the computed d'z, t up to 7 (a floor of 2^-24 comes on top)
{ |a| <= 1825b-35 /\                #: uses row_origin
  |b| <= 700b-35 /\                 #: uses row_direction
  t in [0, 7]
  -> |a - t * b| <= 6725b-35 }      #: proves instance_depth
