# The direction of the ray of an entered object. Its exact value d is floored to 51 fraction bits (A; X >> n is the floor of a floor, so a
# floor of d), then rounded to the format direction (d').
#: row instance_long | instance_enter: A, error
#: row instance_direction | instance_enter: d', error
@long = fixed<-51,dn>;
@narrow = fixed<-26,nu>;            #: format direction
a = long(d);
code = narrow(a);
{ |d| <= 1 ->
  |a - d| <= 1b-51 /\               #: proves instance_long
  |code - d| <= 16777217b-51 }      #: proves instance_direction
