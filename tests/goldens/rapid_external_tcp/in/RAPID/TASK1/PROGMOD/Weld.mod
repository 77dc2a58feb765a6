MODULE Weld
  ! golden: the robot holds the part (robhold TRUE) and the gun stands still: the target is the gun seen from the part.
  ! golden: A deviation D of the part gives P' = D P, with Offs turned likewise; uframe and oframe of the held object count not.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[905.20,240.10,660.30],[0.965925826,0.129409523,-0.224143868,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pVia:=[[955.20,240.10,560.30],[0.965925826,0.129409523,-0.224143868,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pPick:=[[1,2,3],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rWeld()
    MoveAbsJ jHome,v1000,fine,tGun;
    SpotL S1,v800,gun1,sd1,tFixed\WObj:=wPart;
    MoveL Offs(S1,0,0,-100),v800,z10,tFixed\WObj:=wPart;
    MoveL RelTool(S1,0,0,-50),v800,z10,tFixed\WObj:=wPart;
    MoveL pVia,v800,z10,tFixed\WObj:=wPart;
    MoveJ pPick,v800,fine,tGun\WObj:=wDress;
    MoveAbsJ jHome,v1000,fine,tGun;
  ENDPROC
ENDMODULE
