MODULE Weld
  !respot: 0.1.0 align theory, for the cell as simulated; the real old cell must never load this file
  !respot: source sha256 73d176170e58765b48c4d2449e4a8463599ec38eed52cbb5d6c7ddd1c461a1f1
  !respot: calibration sha256 4fda5d304c9a3c501651ad5371294383039e4b91f73d41cada5e95afd7f8f0c7
  ! golden: the robot holds the part (robhold TRUE) and the gun stands still: the target is the gun seen from the part.
  ! golden: A deviation D of the part gives P' = D P, with Offs turned likewise; uframe and oframe of the held object count not.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[922.102,216.920,671.573],[0.962417975,0.137616957,-0.233842545,0.011440209],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pVia:=[[974.389,219.266,572.777],[0.962417975,0.137616957,-0.233842545,0.011440209],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pPick:=[[1,2,3],[0.97,0.1,-0.2,0.0953939],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rWeld()
    MoveAbsJ jHome,v1000,fine,tGun;
    SpotL S1,v800,gun1,sd1,tFixed\WObj:=wPart;
    MoveL Offs(S1,2.313,1.190,-99.966),v800,z10,tFixed\WObj:=wPart;
    MoveL RelTool(S1,0,0,-50),v800,z10,tFixed\WObj:=wPart;
    MoveL pVia,v800,z10,tFixed\WObj:=wPart;
    MoveJ pPick,v800,fine,tGun\WObj:=wDress;
    MoveAbsJ jHome,v1000,fine,tGun;
  ENDPROC
ENDMODULE
