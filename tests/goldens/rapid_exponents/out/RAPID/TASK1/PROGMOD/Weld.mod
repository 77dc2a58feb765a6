MODULE Weld
  !respot: 0.1.0 align theory, for the cell as simulated; the real old cell must never load this file
  !respot: source sha256 79ce0f6ce34e8c16c8bdf49e72d986a85163b84a1ef288f4c4c04a11467281fa
  !respot: calibration sha256 4fda5d304c9a3c501651ad5371294383039e4b91f73d41cada5e95afd7f8f0c7
  ! golden: exponents among the numbers that change are written out, with the decimals that they had;
  ! golden: all numbers of a group get the decimals of the finest, so that the way back finds every digit.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[113.398,-63.532,79.672],[0.4974493,-0.5130501,0.4887058,0.5004902],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.193,202.709,118.395],[0.963638134,0.130615810,-0.232626503,0.015032163],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p1:=[[107.910,-11.781,26.310],[0.99986159,-0.00201368,-0.00923885,0.01368897],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p2:=[[108.846,-44.277,24.194],[0.7145312,-0.0110314,0.6994674,0.0083329],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rWeld()
    MoveAbsJ jHome,v1000,fine,tGun;
    SpotL S1,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveL p1,v100,z10,tGun\WObj:=wDoor;
    MoveL p2,v100,z10,tGun\WObj:=wDoor;
    MoveL [[108.3820,-23.8030,19.6105],[0.9998475,-0.0019943,-0.0106529,0.0136917],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun\WObj:=wDoor;
    SpotL S2,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveAbsJ jHome,v1000,fine,tGun;
  ENDPROC
ENDMODULE
