MODULE Weld
  !respot: 0.1.0 align theory, for the cell as simulated; the real old cell must never load this file
  !respot: source sha256 cf7dbc52ce0ea5b425b16f9cfe758e676b29ddf41a35f2e6dc20dfa5e664ca5b
  !respot: calibration sha256 4fda5d304c9a3c501651ad5371294383039e4b91f73d41cada5e95afd7f8f0c7
  ! golden: targets stand anywhere: in the instruction, in the routine's own data, handed to a routine that goes there,
  ! golden: two in a line, over several lines, behind a compact IF; a comment that looks like one is none.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[113.398,-63.532,79.672],[0.4974493,-0.5130501,0.4887058,0.5004902],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.193,202.709,118.395],[0.963638134,0.130615810,-0.232626503,0.015032163],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rWeld()
    MoveAbsJ jHome,v1000,fine,tGun;
    SpotL S1,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveL [[107.692,-13.736,39.065],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun\WObj:=wDoor; MoveJ [[117.686,-13.461,39.277],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun\WObj:=wDoor;
    MoveL [[128.180,
      -13.174,39.500] , [0.9998477,-0.0019081,-0.0106517,0.0136926],[0,0,0,0],
      [9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun\WObj:=wDoor;
    IF TRUE MoveL [[137.674,-12.913,39.702],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun\WObj:=wDoor;
    !MoveL [[131,10,20],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun\WObj:=wDoor;
    rGo [[147.668,-12.639,39.915],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    rOwn;
    SpotL S2,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveAbsJ jHome,v1000,fine,tGun;
  ENDPROC
  PROC rGo(robtarget p)
    MoveL p,v100,z10,tGun\WObj:=wDoor;
  ENDPROC
  PROC rOwn()
    CONST robtarget S1:=[[157.662,-12.365,40.127],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    MoveL S1,v100,z10,tGun\WObj:=wDoor;
  ENDPROC
ENDMODULE
