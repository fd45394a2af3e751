; Intersection of a ray with a triangle by the transformation that makes it the unit triangle (Woop, Schmittler, Slusallek 2005): 13 words.
;   A.y      address of the transformation: rows of u, v, z and their offsets, then (shader, 0, 0, 0)
;   R2, R3   origin and direction
;   R4       best hit so far: u, v, t
; It returns where there is no nearer hit; else R4, SID and MAX are those of this one.
	load4x A.y,0                     ; transformation

	dp3_rcp R7.z,I2,R3               ; direction in it
	dp3 R7.y,I1,R3
	dp3 R7.x,I0,R3
	dph3 R6.x,I0,R2                  ; origin in it
	dph3 R6.y,I1,R2
	dph3 R6.z,I2,R2

	mul R8.z,-R6.z,S.z               ; t
	+ if z <0
	  return
	mad R8.xy,R8.z,R7,R6             ; u, v
	+ if or xy (<0 or >=1)
	  return
	add R8.w,R8.x,R8.y               ; u + v
	+ if w >=1
	  return
	add R8.w,R8.z,-R4.z              ; nearer than the best one
	+ if w >=0
	  return
	mov SID,I3.x                     ; it is the best one
	+ mov MAX,R8.z
	mov R4.xyz,R8
	+ return
