# The slabs of instance_enter, in units of 2^spread. f: floor of the origin; error: d' against the exact direction; tau: t of a point of the exact
# ray in the box, below 10.5; d: magnitude of d'; r: relative error of its reciprocal; g: floor of t_plane.
# near <= tau: tau d' misses the grown plane by at most `early`, which must not exceed the pad.
# far >= tau: (pad - tau error) (1 - r) / d >= tau r + g, multiplied by d.
#: row instance_early | instance_enter: what the lower side of a slab must allow for, position
#: row instance_margin | instance_enter: what is left of the pad at the upper side of a slab
pad = 8b-24;                        #: contract slab_pad
early = f + tau * error;
margin = (pad - tau * error) * (1 - r) - (tau * r + g) * d;
{ tau in [0, 10.5] /\ f in [0, 1b-24] /\ g in [0, 1b-24] /\ r in [0, 1b-25] /\ d in [0, 67108865b-26] /\
  |error| <= 16777217b-51           #: uses instance_direction
  -> |early| <= 40b-28 /\           #: proves instance_early
  margin >= 1b-28 }                #: proves instance_margin
