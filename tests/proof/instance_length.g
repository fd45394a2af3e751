# The length of d'. With N = sqrt(sum g^2) / 2^9 in units of 2^L: the length of D lies in [N - sqrt 3 / 2^9, N], and N > 1 where k = L + 1.
# Where k = L, some component of D is at least 1/2, and N <= 1. Lengths change by at most sqrt 3 times the error of a component.
#: row instance_shortest | instance_enter: least length of d'
#: row instance_longest | instance_enter: largest length of d'
halved = (N - off) * 1b-1;          # k = L + 1
{ N in [1, 1.7321] /\ off in [0, 3547b-20] /\       # sqrt 3 / 2^9
  step in [-1, 1] /\ M in [1b-1, 1] /\              # length of D where k = L
  |error| <= 16777217b-51           #: uses instance_direction
  -> halved + 1.7321 * error * step >= 510b-10 /\   #: proves instance_shortest
  M + 1.7321 * error * step >= 510b-10 /\
  halved + 1.7321 * error * step <= 1 /\
  M + 1.7321 * error * step <= 67108865b-26 }       #: proves instance_longest
