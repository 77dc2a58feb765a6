MODULE Weld
  !respot: 0.1.0 align theory, for the cell as simulated; the real old cell must never load this file
  !respot: source sha256 76c13a813aded14d9cbacd8cc838b777e3ef2239caa8aa8d040f81b675eadddf
  !respot: calibration sha256 4fda5d304c9a3c501651ad5371294383039e4b91f73d41cada5e95afd7f8f0c7
  ! golden: MoveC, ArcC, TriggC and SearchC go through one point to another: both move, or the arc bends through the part.
  ! golden: A wrapper of the plant, SpotC, is known by the types of its arguments, and moves both as well.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[113.398,-63.532,79.672],[0.4974493,-0.5130501,0.4887058,0.5004902],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.193,202.709,118.395],[0.963638134,0.130615810,-0.232626503,0.015032163],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p1:=[[106.505,6.362,68.976],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p2:=[[127.313,-23.078,69.524],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p3:=[[146.481,7.459,69.826],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p4:=[[167.289,-21.981,70.374],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p5:=[[186.457,8.556,70.676],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR robtarget pFound;
  VAR triggdata trg1;
  PROC rWeld()
    MoveAbsJ jHome,v1000,fine,tGun;
    SpotL S1,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveL p1,v100,z10,tGun\WObj:=wDoor;
    MoveC p2,p3,v100,z10,tGun\WObj:=wDoor;
    MoveC [[166.469,8.008,70.251],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],Offs(p3,39.976,1.097,0.850),v100,z10,tGun\WObj:=wDoor;
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
