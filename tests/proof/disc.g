# Weighted sums over the unit disc: |x b + w y c| for x^2 + y^2 <= 1, |b| <= 1, |c| <= 1 and a weight w of 1, 2 or 4
# (the latter two with a little room). The exact maximum is sqrt(1 + w^2). This is where orthogonality enters: two rows
# at right angles see a vector as a point of a disc, not of a square. y is written as tau times the half-chord at x,
# which covers the disc; gappa bisects x.
#@ -Echange-threshold=0
y = tau * sqrt(1 - x*x);
one = x*b + y*c;
two = x*b + y*c*2.000001;
four = x*b + y*c*4.000002;
{ x in [-1, 1] /\ 1 - x*x >= 0 /\ |tau| <= 1 /\ |b| <= 1 /\ |c| <= 1 ->
  |one| <= 1.4144 /\    #: proves disc_1
  |two| <= 2.2363 /\    #: proves disc_2
  |four| <= 4.1234 }    #: proves disc_4
|one| $ x;
|two| $ x;
|four| $ x;
