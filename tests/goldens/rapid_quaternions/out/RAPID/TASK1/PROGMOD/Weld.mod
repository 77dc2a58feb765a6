MODULE Weld
  !respot: 0.1.0 align theory, for the cell as simulated; the real old cell must never load this file
  !respot: source sha256 37b1f1689540ced62337587c3b9f80676e672d21c66411352473e2728598e551
  !respot: calibration sha256 4fda5d304c9a3c501651ad5371294383039e4b91f73d41cada5e95afd7f8f0c7
  ! golden: q and -q are one orientation: the sign stays that of the source, and so does the length, within what it had.
  ! golden: Three, six or nine digits: at least seven are written, with which the length is 1 within 1e-7.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[113.398,-63.532,79.672],[0.4974493,-0.5130501,0.4887058,0.5004902],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.193,202.709,118.395],[0.963638134,0.130615810,-0.232626503,0.015032163],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p1:=[[108.692,-13.708,39.086],[-0.4867976,0.4993575,0.5111419,-0.5023984],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p2:=[[109.691,-13.681,39.107],[0.0106517,-0.0136926,0.9998477,-0.0019081],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p3:=[[110.690,-13.653,39.129],[0.7144231,-0.0110297,0.6993616,0.0083316],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p4:=[[111.690,-13.626,39.150],[-0.71668122,-0.00618262,0.00888113,0.69731695],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p5:=[[112.689,-13.599,39.171],[0.0080904,-0.9998168,-0.0137984,-0.0105142],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p6:=[[113.689,-13.571,39.192],[0.6908313,-0.0089365,-0.0061023,0.7229358],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
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
