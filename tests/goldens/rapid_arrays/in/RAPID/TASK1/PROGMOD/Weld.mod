MODULE Weld
  ! golden: targets of arrays move where they stand, of one dimension and two, over several lines, and in records;
  ! golden: those that nobody goes to, or goes to under another work object, stay.
  RECORD visit
    num speed;
    robtarget place;
  ENDRECORD
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[105.20,-40.10,60.30],[0.5,-0.5,0.5,0.5],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.00,220.50,95.75],[0.965925826,0.129409523,-0.224143868,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pSpots{4}:=[[[50,10.5,20],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
    [[100,10.5,20],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
    [[150,10.5,20],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
    [[200,10.5,20],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  CONST robtarget pGrid{2,2}:=[[[[100,0,0],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[100,100,0],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]],
    [[[200,0,0],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[200,100,0],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]]];
  PERS visit tdOne:=[5,[[150,50,50],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
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
