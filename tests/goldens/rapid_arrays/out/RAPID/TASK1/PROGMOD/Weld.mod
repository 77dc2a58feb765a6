MODULE Weld
  !respot: 0.1.0 align theory, for the cell as simulated; the real old cell must never load this file
  !respot: source sha256 10f458c8ef429cc89d8ac87a656c2bbcfdea7848c58aed17c012ad47c4fe8e47
  !respot: calibration sha256 4fda5d304c9a3c501651ad5371294383039e4b91f73d41cada5e95afd7f8f0c7
  ! golden: targets of arrays move where they stand, of one dimension and two, over several lines, and in records;
  ! golden: those that nobody goes to, or goes to under another work object, stay.
  RECORD visit
    num speed;
    robtarget place;
  ENDRECORD
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[113.398,-63.532,79.672],[0.4974493,-0.5130501,0.4887058,0.5004902],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.193,202.709,118.395],[0.963638134,0.130615810,-0.232626503,0.015032163],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pSpots{4}:=[[[57.709,-14.607,38.000],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
    [[100,10.5,20],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
    [[157.648,-11.865,40.125],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
    [[200,10.5,20],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  CONST robtarget pGrid{2,2}:=[[[[100,0,0],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[100,100,0],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]],
    [[[208.332,-21.060,21.235],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[200,100,0],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]]];
  PERS visit tdOne:=[5,[[155.928,27.726,69.956],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  PROC rWeld()
    MoveAbsJ jHome,v1000,fine,tGun;
    SpotL S1,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveL pSpots{1},v100,z10,tGun\WObj:=wDoor;
    MoveL PSPOTS{3},v100,z10,tGun\WObj:=wDoor;
    MoveJ pGrid{2,1},v100,z10,tGun\WObj:=wDoor;
    MoveL tdOne.place,v100,z10,tGun\WObj:=wDoor;
    MoveL pSpots{2},v100,z10,tGun\WObj:=wDress;
    SpotL S2,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveAbsJ jHome,v1000,fine,tGun;
  ENDPROC
ENDMODULE
