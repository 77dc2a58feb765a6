MODULE Weld
  ! golden: q and -q are one orientation: the sign stays that of the source, and so does the length, within what it had.
  ! golden: Three, six or nine digits: at least seven are written, with which the length is 1 within 1e-7.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[105.20,-40.10,60.30],[0.5,-0.5,0.5,0.5],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.00,220.50,95.75],[0.965925826,0.129409523,-0.224143868,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p1:=[[101,10,20],[-0.5,0.5,0.5,-0.5],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p2:=[[102,10,20],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p3:=[[103,10,20],[0.707,0,0.707,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p4:=[[104,10,20],[-0.70710678,0,0,0.70710678],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p5:=[[105,10,20],[0.01,-0.999950,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p6:=[[106,10,20],[0.700707,0,0,0.713450],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rWeld()
    MoveAbsJ jHome,v1000,fine,tGun;
    SpotL S1,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveL p1,v100,z10,tGun\WObj:=wDoor;
    MoveL p2,v100,z10,tGun\WObj:=wDoor;
    MoveL p3,v100,z10,tGun\WObj:=wDoor;
    MoveL p4,v100,z10,tGun\WObj:=wDoor;
    MoveL p5,v100,z10,tGun\WObj:=wDoor;
    MoveL p6,v100,z10,tGun\WObj:=wDoor;
    SpotL S2,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveAbsJ jHome,v1000,fine,tGun;
  ENDPROC
ENDMODULE
