MODULE Weld
  !respot: 0.1.0 align theory, for the cell as simulated; the real old cell must never load this file
  !respot: source sha256 8761dcb0a21bf9512106f2bf4522149cfb563bd2ba1318a82a4725ea66597d80
  !respot: calibration sha256 4fda5d304c9a3c501651ad5371294383039e4b91f73d41cada5e95afd7f8f0c7
  ! golden: o_p1 is what p1 was before it was touched up; the controller compares the two and stops at too much.
  ! golden: Both move, so that the touch-up stays what it was. o_free has no twin that moves and stays.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[113.398,-63.532,79.672],[0.4974493,-0.5130501,0.4887058,0.5004902],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.193,202.709,118.395],[0.963638134,0.130615810,-0.232626503,0.015032163],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST o_robtarget o_p1:=[[107.692,-13.736,39.065],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p1:=[[108.955,-14.201,39.093],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p2:=[[127.680,-13.187,39.490],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST o_robtarget o_free:=[[1,2,3],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rWeld()
    MoveAbsJ jHome,v1000,fine,tGun;
    SpotL S1,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveL p1,v100,z10,tGun\WObj:=wDoor;
    MoveL p2,v100,z10,tGun\WObj:=wDoor;
    SpotL S2,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveAbsJ jHome,v1000,fine,tGun;
  ENDPROC
ENDMODULE
