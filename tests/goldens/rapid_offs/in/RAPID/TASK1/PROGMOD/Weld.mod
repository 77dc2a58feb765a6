MODULE Weld
  ! golden: Offs goes along the work object: its distances turn with the correction, M Offs(p,d) = Offs(M p, R d).
  ! golden: RelTool goes along the tool, which turns with its target: its distances and turns stay, also around or within Offs.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[105.20,-40.10,60.30],[0.5,-0.5,0.5,0.5],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.00,220.50,95.75],[0.965925826,0.129409523,-0.224143868,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rWeld()
    MoveAbsJ jHome,v1000,fine,tGun;
    SpotL S1,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveL Offs(S1,0,0,150),v100,z10,tGun\WObj:=wDoor;
    MoveL Offs(S1, 10.5 , -20.25,+30),v100,z10,tGun\WObj:=wDoor;
    MoveL RelTool(S1,0,0,-80),v100,z10,tGun\WObj:=wDoor;
    MoveL RelTool(S2,0,5,-80\Rz:=30),v100,z10,tGun\WObj:=wDoor;
    MoveL Offs(RelTool(S1,0,0,-80),0,40,0),v100,z10,tGun\WObj:=wDoor;
    MoveL RelTool(Offs(S1,0,0,50),0,0,-10),v100,z10,tGun\WObj:=wDoor;
    MoveL Offs([[100,10,20],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],0,0,1E2),v100,z10,tGun\WObj:=wDoor;
    SpotL S2,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveAbsJ jHome,v1000,fine,tGun;
  ENDPROC
ENDMODULE
