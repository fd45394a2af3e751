# Where an entered ray begins: near is no further from the box than `grown` on any axis, in units of 2^spread (y: distance to the grown plane,
# up to 3), q is up to 1/16 before near, and the box lies in [-7/8, 7/8]. So |o'| stays below 1: what row_origin assumes.
#: row instance_grown | instance_enter: distance of near from the box, in units of 2^spread
#: row instance_reach | instance_enter: largest magnitude of a component of o'
pad = 8b-24;                        #: contract slab_pad
grown = pad + y * r + g + f + tau * error;
reach = box + grown * scale + step * d + late;
{ tau in [0, 10.5] /\ f in [0, 1b-24] /\ g in [0, 1b-24] /\ r in [0, 1b-25] /\ y in [0, 3] /\
  box in [-7b-3, 7b-3] /\ scale in [1, 1b16] /\ step in [-1b-4, 1b-4] /\ d in [0, 1] /\
  |late| <= 129b-32 /\              #: uses instance_origin
  |error| <= 16777217b-51           #: uses instance_direction
  -> |grown| <= 13b-24 /\           #: proves instance_grown
  |reach| <= 1013b-10 }             #: proves instance_reach
