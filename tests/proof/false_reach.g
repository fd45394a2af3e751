# How far from the triangle itself an accepted hit can lie, times the cosine and the sine of the middle angle. A point
# outside is brought back by at most two shifts along the edges at vertex 0 (documentation: False hits): by the excess
# over edge w and that beyond vertex 2; or by those outside u and beyond vertex 2 (v, 1 alike); or by those outside u and
# v, at an angle that makes them sqrt 3 times one at worst.
#: row false_reach | accepted hit: distance from the triangle, times the cosine and the sine of the middle angle
{ |w| <= 50296b-35 /\               #: uses false_w
  |uv| <= 25890b-35 /\              #: uses false_uv
  |top| <= 25890b-35 ->             #: uses false_top
  |w + top| <= 76186b-35 /\         #: proves false_reach
  |uv + top| <= 76186b-35 /\        #: proves false_reach_side
  |1.7321 * uv| <= 76186b-35 }      #: proves false_reach_corner
