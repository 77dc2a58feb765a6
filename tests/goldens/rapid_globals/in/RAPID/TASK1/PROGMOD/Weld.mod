MODULE Weld
  ! golden: a target of a system module stands once and moves once, though two programs go to it; the second comes into scope;
  ! golden: a LOCAL target of the same name in another module is another one.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[105.20,-40.10,60.30],[0.5,-0.5,0.5,0.5],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.00,220.50,95.75],[0.965925826,0.129409523,-0.224143868,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rWeld()
    MoveAbsJ jHome,v1000,fine,tGun;
    SpotL S1,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveL pDock,v100,z10,tGun\WObj:=wDoor;
    rOther;
    SpotL S2,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveAbsJ jHome,v1000,fine,tGun;
  ENDPROC
ENDMODULE
