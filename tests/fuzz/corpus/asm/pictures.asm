; Pictures by programs. The label of a picture is where its threads begin; NAME_surface shades what was hit, `sky` what was not (docs/shader.md).
;
; Constants, in units of the grid:
;   C0.w      how far rays start off a surface
;   C1 to C3  rows of the direction of a sample (P.x, P.y, 1); C4 to C6 rows of its origin
;   C7        place of the light; w: light from everywhere
;   C8        light; w: exponent of the highlight
;   C9, C10   sky below and above; C9.w: step of the height field; C10.w: bounces
;   C11       texture of the surroundings (address, width, height)
;   C12       factors of the random numbers
;   C13       glass: 0.96, index, 1 / index, 0.04
;   C14       sphere: place; w: radius
;   C15       height field: texture; w: height
; Vectors of a triangle: normals of its three vertices (w of the first: address of the material), its own normal, texture coordinates of vertices 0 and 1,
; of vertex 2. Vectors of a material: places of its shaders; base colour; light of its own; texture (address, width, height).
; Colours come back in O. Everything shares one window except where a call pushes.

; ---- R0 origin, R1 unit direction of the thread's sample
camera:
par    (dp2h R0.x,C4,P
	dp2h R0.y,C5,P
	dp2h R0.z,C6,P
	dp2h R1.x,C1,P
	dp2h R1.y,C2,P
	dp2h R1.z,C3,P)
	dp3_rsq R1.w,R1,R1
	mul R1.xyz,R1,S.w + return

; ---- what the ray R0, R1 has hit: R2 place, R3 unit normal on the side of the ray (w: below 0 from the front), R4 colour, A.x material; uses R5 to R7
hit_point:
	mad R2.xyz,R1,HIT.x,R0 + load4x TRI,0
	add R6.x,HIT.y,HIT.z
	add R6.x,C.y,-R6.x               ; share of vertex 0
	mul R3.xyz,R6.x,I0
	mad R3.xyz,HIT.y,I1,R3
	mad R3.xyz,HIT.z,I2,R3
	mov A.x,I0.w
	dp3_rsq R3.w,R3,R3
	mul R3.xyz,R3,S.w
	dp3 R3.w,I3,R1 + jmp front, w <0
	mov R3.xyz,-R3
front:
	load I0,TRI,4
	load I1,TRI,5
	mul R5.xy,R6.x,I0
	mad R5.xy,HIT.y,I0.zw,R5
	mad R5.xy,HIT.z,I1,R5
	load I0,A.x,3
	mov R6,I0                        ; the texture
	mad R5.xy,R5,R6.yz,-0.5          ; from the middle of a texel
	call texture push 0
	load I0,A.x,1
	mul R4.xyz,R4,I0 + return

; ---- R4: the texture R6 at R5, in texels, bilinear; uses R7
texture:
	texload4x R6,R5
	frac R7.xy,R5
	add R7.zw,C.y,-R7.xyxy
	mul R7,R7.zxzx,R7.wwyy
	mul R4,R7.x,I0
	mad R4,R7.y,I1,R4
	mad R4,R7.z,I2,R4
	mad R4,R7.w,I3,R4 + return

; ---- R8: what the light gives to the place R2 with the normal R3, R7: unit direction to it; uses R5, R6.w, R9
direct:
	add R7.xyz,C7,-R2
	dp3_rsq R7.w,R7,R7
	mul R5.y,R7.w,S.w                ; distance
	mul R7.xyz,R7,S.w
	dp3 R6.w,R3,R7 + jmp dark, w <=0
	mov R5.x,C.x + mov R5.z,C.y      ; any hit before it
	mad R9.xyz,C0.w,R3,R2
	trace R9,R7,R5
	mov R9.w,HIT.w + jmp dark, w >=0
	mul R8.xyz,C8,R6.w + return
dark:
	mov R8.xyz,C.x + return

; ---- O: the sky in the direction R1; uses R6.w, R7
sky:
	mad R6.w,0.5,R1.y,0.5
	add R7,C10,-C9
	mad O.xyz,R6.w,R7,C9 + return

; ---- what every picture with materials begins with
primary:
phong:
reflection:
refraction:
environment:
	call camera push 0
	trace R0,R1,C.xwxx
	call HIT.w push 0
	exit 0

; ---- primary rays: colour by the angle to the ray
primary_surface:
	call hit_point push 0
	dp3 R6.w,R3,R1
	mad R6.w,-0.75,R6.w,0.25
	mul O.xyz,R4,R6.w + return

; ---- Phong's shading with shadows
phong_surface:
	call hit_point push 0
	call direct push 0
	dp3 R6.x,R1,R3
	mad R9.xyz,-2*R6.x,R3,R1         ; mirrored
	dp3_sat R6.y,R9,R7
	add R6.z,C.y,-R6.y
	mad_rcp R6.z,C8.w,R6.z,R6.y      ; s / (k - k s + s) for a power of s
	mul R6.y,R6.y,S.z
	mul R6.y,R6.y,0.25
	add R9.xyz,R8,C7.w
	mul R9.xyz,R9,R4
	load I0,A.x,2
	add R9.xyz,R9,I0
	mad O.xyz,R8,R6.y,R9 + return

; ---- the same with mirrors: more of them the flatter the ray
reflection_surface:
	call phong_surface push 0
	add R6.w,H.z,-C10.w
	+ return w >=0                   ; enough bounces
	dp3 R6.x,-R1,R3
	add_sat R6.y,C.y,-R6.x
	mul R6.z,R6.y,R6.y
	mul R6.z,R6.z,R6.y
	mad R5.w,0.75,R6.z,0.25
	add R6.y,C.y,-R5.w
	mul R5.xyz,O,R6.y
	mad R7.xyz,2*R6.x,R3,R1
	mad R6.xyz,C0.w,R3,R2
	add H.z,H.z,C.y
	trace R6,R7,C.xwxx
	call HIT.w push 6                ; R6 and R7 are its R0 and R1
	add H.z,H.z,-C.y
	mad O.xyz,R5.w,O,R5 + return

; ---- glass: refraction, total reflection, Fresnel's share by Schlick
refraction_surface:
	call hit_point push 0
	add R6.w,H.z,-C10.w
	+ jmp sky, w >=0
	mov R5.x,C13.z
	mov R6.w,R3.w + jmp enters, w <0
	mov R5.x,C13.y
enters:
	dp3 R5.y,-R1,R3                  ; cosine
	mul R6.x,R5.y,R5.y
	add R6.x,C.y,-R6.x
	mul R6.y,R5.x,R5.x
	mul R6.x,R6.x,R6.y
	mov R4.xyz,C.x + mov R5.w,C.y
	add H.z,H.z,C.y
	add_rsq R5.z,C.y,-R6.x
	+ jmp mirror, z <=0              ; total reflection
	mul R5.z,R5.z,S.z                ; cosine of the other side
	mad R6.x,R5.x,R5.y,-R5.z
	mul R7.xyz,R5.x,R1
	mad R7.xyz,R6.x,R3,R7
	mad R6.xyz,-C0.w,R3,R2
	trace R6,R7,C.xwxx
	call HIT.w push 6
	mul R4.xyz,O,0.95
	add R6.x,R5.y,-R5.z              ; the smaller cosine
	+ jmp smaller, x <0
	mov R5.y,R5.z
smaller:
	add_sat R5.w,C.y,-R5.y
	mul R6.x,R5.w,R5.w
	mul R6.x,R6.x,R6.x
	mul R5.w,R6.x,R5.w
	mad R5.w,C13.x,R5.w,C13.w
mirror:
	dp3 R6.w,-R1,R3
	mad R7.xyz,2*R6.w,R3,R1
	mad R6.xyz,C0.w,R3,R2
	trace R6,R7,C.xwxx
	call HIT.w push 6
	add H.z,H.z,-C.y
	add R6.x,C.y,-R5.w
	mul R4.xyz,R4,R6.x
	mad O.xyz,R5.w,O,R4 + return

; ---- surroundings in a texture, mirrored in everything
environment_surface:
	call hit_point push 0
	dp3 R6.x,-R1,R3
	mad R1.xyz,2*R6.x,R3,R1
	mov R8.xyz,R4
	call environment_sky push 0
	mul R8.xyz,R8,0.5
	mad O.xyz,R8,O,O
	mul O.xyz,O,0.75 + return
environment_sky:
	mov R6,C11
	mad R5.xy,R1,0.5,0.5
	add R5.y,C.y,-R5.y
	mad R5.xy,R5,R6.yz,-0.5
	call texture push 0
	mov O.xyz,R4 + return

; ---- R6.xyz: three random numbers in [0, 1) of the sample and a counter, R13.x; uses R7
random:
	add R13.x,R13.x,C.y
	mov R6.xy,P
	mad R6.z,P.z,C12.w,R13.x
	mul R6.xyz,R6,C12
	frac R6.xyz,R6
	add R7.xyz,R6.yxz,33.25
	dp3 R6.w,R6,R7
	add R6.xyz,R6,R6.w
	add R7.xyz,R6.xxy,R6.yxx
	mul R7.xyz,R7,R6.zyx
	frac R6.xyz,R7 + return

; ---- paths: light of the sky and of the lamp, diffuse surfaces. R10 light so far, R11 what is left of it, R12.x bounces
path:
	call camera push 0
par    (mov R10,C.x + mov R11,C.y
	mov R12,C.x + mov R13,C.x)
bounce:
	trace R0,R1,C.xwxx
	mov R6.w,HIT.w + jmp path_sky, w <0
	call hit_point push 0
	load I0,A.x,2
	mad R10.xyz,R11,I0,R10
	mul R11.xyz,R11,R4
	call direct push 0
	mad R10.xyz,R11,R8,R10
	add R12.x,R12.x,C.y
	add R6.x,R12.x,-C10.w
	+ jmp path_end, x >=0
draw:                                    ; a unit vector on the sphere, by rejection
	call random push 0
	mad R7.xyz,2.0,R6,-1.0
	dp3_rsq R7.w,R7,R7 + jmp draw, w (=0 or >=1)
	mad R1.xyz,R7,S.w,R3
	dp3_rsq R1.w,R1,R1 + jmp draw, w =0
	mul R1.xyz,R1,S.w
	mad R0.xyz,C0.w,R3,R2
	jmp bounce
path_sky:
	call sky push 0
	mad R10.xyz,R11,O,R10
path_end:
	mov O.xyz,R10 + exit 0

; ---- a sphere without triangles, before or behind the scene; it mirrors the scene
sphere:
	call camera push 0
	trace R0,R1,C.xwxx
	add R8.xyz,R0,-C14               ; t^2 + 2 b t + c = 0
	dp3 R9.x,R8,R1
	mul R9.w,C14.w,C14.w
	dp3 R9.y,R8,R8
	add R9.y,R9.y,-R9.w
	mul R9.z,R9.x,R9.x
	add_rsq R9.z,R9.z,-R9.y + jmp no_sphere, z <=0
	mul R9.z,R9.z,S.z
	add R9.x,-R9.x,-R9.z + jmp no_sphere, x <=0
	add R9.y,R9.x,-HIT.x + jmp no_sphere, y >=0
	mad R2.xyz,R9.x,R1,R0
	add R3.xyz,R2,-C14
	dp3_rsq R3.w,R3,R3
	mul R3.xyz,R3,S.w
	dp3 R6.x,-R1,R3
	mad R1.xyz,2*R6.x,R3,R1
	mad R0.xyz,C0.w,R3,R2
	trace R0,R1,C.xwxx
	call HIT.w push 0
	mul O.xyz,O,0.875
	exit 0
no_sphere:
	call HIT.w push 0
	exit 0
sphere_surface:
	jmp phong_surface

; ---- a field of heights in a texture, by steps along the ray. R10.x distance, R10.y steps left
heightfield:
	call camera push 0
	mov R10.x,C.x + mov R10.y,160.0
march:
	add R10.y,R10.y,-C.y + jmp sky_end, y <0
	add R10.x,R10.x,C9.w
	mad R2.xyz,R10.x,R1,R0
	add R9.x,R2.y,-C15.w             ; above all heights
	+ jmp march, x >0
	call height push 0
	add R9.x,R2.y,-R8.w + jmp march, x >0
	mov R11,R8.w                     ; there: slopes from two neighbours
	mov R12.xyz,R2
	add R2.x,R12.x,C9.w
	call height push 0
	mov R11.x,R8.w
	mov R2.xyz,R12
	add R2.z,R12.z,C9.w
	call height push 0
	mov R11.z,R8.w
	add R3.x,R11.y,-R11.x
	add R3.z,R11.y,-R11.z
	mov R3.y,C9.w
	dp3_rsq R3.w,R3,R3
	mul R3.xyz,R3,S.w
	add R7.xyz,C7,-R12
	dp3_rsq R7.w,R7,R7
	mul R7.xyz,R7,S.w
	dp3_sat R6.w,R3,R7
	add R6.w,R6.w,C7.w
	mul R8.xyz,C8,R6.w
	mul O.xyz,R8,R4
	exit 0
sky_end:
	call sky push 0
	exit 0
; ---- R8.w: height of the field at R2.xz, R4: its colour; uses R5 to R7
height:
	mov R6,C15
	mul R5.xy,R2.xz,R6.yz
	mad R5.xy,R5,0.5,R6.yz
	call texture push 0
	mul R8.w,R4.w,C15.w + return
