MODULE Weld
  ! golden: the tip lies 1.5, -2.25, 4 mm from where tGun says, along the tool: compensated, its tframe becomes tframe d, and
  ! golden: every target keeps its numbers, Offs and RelTool too. tGrip is right.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[105.20,-40.10,60.30],[0.5,-0.5,0.5,0.5],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.00,220.50,95.75],[0.965925826,0.129409523,-0.224143868,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pGrip:=[[10,20,30],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rWeld()
    MoveAbsJ jHome,v1000,fine,tGun;
    SpotL S1,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveL Offs(S1,0,25,-50),v100,z10,tGun\WObj:=wDoor;
    MoveL RelTool(S1,0,0,-80),v100,z10,tGun\WObj:=wDoor;
    SpotL S2,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveL pGrip,v100,z10,tGrip\WObj:=wDress;
    MoveAbsJ jHome,v1000,fine,tGun;
  ENDPROC
ENDMODULE
