MODULE Weld
  !respot: 0.1.0 align theory, for the cell as simulated; the real old cell must never load this file
  !respot: source sha256 2fb97a79cd55bd8a40acfc0477e6bccad4193b27c1b7e61aeff96870f09f89e4
  !respot: calibration sha256 4fda5d304c9a3c501651ad5371294383039e4b91f73d41cada5e95afd7f8f0c7
  ! golden: 9E9 means no such axis, and every generation spells it its own way: what does not change stays as it was written.
  ! golden: A gun opening or a track among them is no place on the part and stays too, and so does confdata that is kept.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[113.398,-63.532,79.672],[0.4974493,-0.5130501,0.4887058,0.5004902],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.193,202.709,118.395],[0.963638134,0.130615810,-0.232626503,0.015032163],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p1:=[[108.692,-13.708,39.086],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p2:=[[109.691,-13.681,39.107],[0.9666066,0.0998563,-0.2087504,0.1101080],[-1,0,-2,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget p3:=[[110.690,-13.653,39.129],[0.9666066,0.0998563,-0.2087504,0.1101080],[0, 0, 0, 0],[ 9E+9,9E+9, 9E+9,9E+9,9E+9,9E+9 ]];
  CONST robtarget p4:=[[111.690,-13.626,39.150],[0.9666066,0.0998563,-0.2087504,0.1101080],[+0,0,-0,0],[9.0000E+09,9.0000E+09,9.0000E+09,9.0000E+09,9.0000E+09,9.0000E+09]];
  CONST robtarget p5:=[[112.689,-13.599,39.171],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[98.6959,9E+09,1E+10,9e9,-1.5E-05,0]];
  CONST robtarget p6:=[[113.689,-13.571,39.192],[0.9666066,0.0998563,-0.2087504,0.1101080],[1,1,-3,4],[9E+09,115.501,9E+09,9E+09,9000000000,9E+09]];
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
