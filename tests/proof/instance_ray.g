# An entered object's ray against that of the world, at the same t of the object, up to 7: on an axis, so sqrt 3 times that as a distance.
#: row instance_ray | instance_enter: distance on an axis of the object's ray from the world's, at t up to 7
{ |origin| <= 129b-32 /\            #: uses instance_origin
  |direction| <= 16777217b-51 /\    #: uses instance_direction
  t in [0, 7]
  -> |origin + t * direction| <= 2825b-35 }  #: proves instance_ray
