# The origin of the ray of an entered object: o' = nearest(S + t A), with S exact and t = q / 16 exact.
#: row instance_origin | instance_enter: o', error against the ray of the world
@narrow = fixed<-24,nu>;            #: format position
a = d + error;
before = s + t * a;
code = narrow(before);
exact = s + t * d;
{ |error| <= 1b-51 /\               #: uses instance_long
  t in [0, 1b19]                    # q < 2^23
  -> |code - exact| <= 129b-32 }    #: proves instance_origin
code - exact -> (code - before) + t * error;
