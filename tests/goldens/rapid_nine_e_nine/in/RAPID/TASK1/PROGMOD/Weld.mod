MODULE Weld
  ! golden: 9E9 means no such axis, and every generation spells it its own way: what does not change stays as it was written.
  ! golden: A gun opening or a track among them is no place on the part and stays too, and so does confdata that is kept.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[105.20,-40.10,60.30],[0.5,-0.5,0.5,0.5],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.00,220.50,95.75],[0.965925826,0.129409523,-0.224143868,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p1:=[[101,10,20],[0.97,0.1,-0.2,0.0953939],[0,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p2:=[[102,10,20],[0.97,0.1,-0.2,0.0953939],[-1,0,-2,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget p3:=[[103,10,20],[0.97,0.1,-0.2,0.0953939],[0, 0, 0, 0],[ 9E+9,9E+9, 9E+9,9E+9,9E+9,9E+9 ]];
  CONST robtarget p4:=[[104,10,20],[0.97,0.1,-0.2,0.0953939],[+0,0,-0,0],[9.0000E+09,9.0000E+09,9.0000E+09,9.0000E+09,9.0000E+09,9.0000E+09]];
  CONST robtarget p5:=[[105,10,20],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[98.6959,9E+09,1E+10,9e9,-1.5E-05,0]];
  CONST robtarget p6:=[[106,10,20],[0.97,0.1,-0.2,0.0953939],[1,1,-3,4],[9E+09,115.501,9E+09,9E+09,9000000000,9E+09]];
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
