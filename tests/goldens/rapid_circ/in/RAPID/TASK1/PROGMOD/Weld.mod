MODULE Weld
  ! golden: MoveC, ArcC, TriggC and SearchC go through one point to another: both move, or the arc bends through the part.
  ! golden: A wrapper of the plant, SpotC, is known by the types of its arguments, and moves both as well.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[105.20,-40.10,60.30],[0.5,-0.5,0.5,0.5],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.00,220.50,95.75],[0.965925826,0.129409523,-0.224143868,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p1:=[[100,30,50.0],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p2:=[[120,0,50.0],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p3:=[[140,30,50.0],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p4:=[[160,0,50.0],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p5:=[[180,30,50.0],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR robtarget pFound;
  VAR triggdata trg1;
  PROC rWeld()
    MoveAbsJ jHome,v1000,fine,tGun;
    SpotL S1,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveL p1,v100,z10,tGun\WObj:=wDoor;
    MoveC p2,p3,v100,z10,tGun\WObj:=wDoor;
    MoveC [[160,30,50],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],Offs(p3,40,0,0),v100,z10,tGun\WObj:=wDoor;
    TriggC p2,p1,v100,trg1,z10,tGun\WObj:=wDoor;
    SearchC di1,pFound,p2,p1,v100,tGun\WObj:=wDoor;
    SpotC p4,p5,v100,tGun,wDoor;
    SpotL S2,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveAbsJ jHome,v1000,fine,tGun;
  ENDPROC
  PROC SpotC(robtarget pVia,robtarget pTo,speeddata vel,PERS tooldata tool,PERS wobjdata wobj)
    MoveC pVia,pTo,vel,fine,tool\WObj:=wobj;
  ENDPROC
ENDMODULE
