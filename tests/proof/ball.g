# Sum over the unit ball: |x b + y c + z e| for x^2 + y^2 + z^2 <= 1 and |b|, |c|, |e| <= 1. (The exact maximum is sqrt
# 3.) (x, y) = s (xn, yn) with (xn, yn) in the unit disc and s = rho sqrt(1 - z^2): disc_1 bounds the first two terms.
s = rho * sqrt(1 - z*z);
sum = s * pair + z*e;
{ |pair| <= 1.4144 /\   #: uses disc_1
  z in [-1, 1] /\ 1 - z*z >= 0 /\ |rho| <= 1 /\ |e| <= 1 ->
  |sum| <= 1.7325 }     #: proves ball
|sum| $ z;
