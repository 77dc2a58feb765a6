MODULE Weld
  ! golden: targets stand anywhere: in the instruction, in the routine's own data, handed to a routine that goes there,
  ! golden: two in a line, over several lines, behind a compact IF; a comment that looks like one is none.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[105.20,-40.10,60.30],[0.5,-0.5,0.5,0.5],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.00,220.50,95.75],[0.965925826,0.129409523,-0.224143868,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rWeld()
    MoveAbsJ jHome,v1000,fine,tGun;
    SpotL S1,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveL [[100.00,10.00,20.00],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun\WObj:=wDoor; MoveJ [[110,10,20],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun\WObj:=wDoor;
    MoveL [[120.5,
      10,20] , [1,0,0,0],[0,0,0,0],
      [9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun\WObj:=wDoor;
    IF TRUE MoveL [[130,10,20],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun\WObj:=wDoor;
    !MoveL [[131,10,20],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun\WObj:=wDoor;
    rGo [[140,10,20],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    rOwn;
    SpotL S2,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveAbsJ jHome,v1000,fine,tGun;
  ENDPROC
  PROC rGo(robtarget p)
    MoveL p,v100,z10,tGun\WObj:=wDoor;
  ENDPROC
  PROC rOwn()
    CONST robtarget S1:=[[150,10,20],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    MoveL S1,v100,z10,tGun\WObj:=wDoor;
  ENDPROC
ENDMODULE
