MODULE Weld
  !respot: 0.1.0 align theory, for the cell as simulated; the real old cell must never load this file
  !respot: source sha256 2b56bb72d7b3a7c80a5df307756661b9e5184039336d00c93c716ee62d59c89f
  !respot: calibration sha256 4fda5d304c9a3c501651ad5371294383039e4b91f73d41cada5e95afd7f8f0c7
  ! golden: Offs goes along the work object: its distances turn with the correction, M Offs(p,d) = Offs(M p, R d).
  ! golden: RelTool goes along the tool, which turns with its target: its distances and turns stay, also around or within Offs.
  CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S1:=[[113.398,-63.532,79.672],[0.4974493,-0.5130501,0.4887058,0.5004902],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget S2:=[[310.193,202.709,118.395],[0.963638134,0.130615810,-0.232626503,0.015032163],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rWeld()
    MoveAbsJ jHome,v1000,fine,tGun;
    SpotL S1,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveL Offs(S1,-3.203,0.529,149.965),v100,z10,tGun\WObj:=wDoor;
    MoveL Offs(S1, 10.407 , -19.849,30.299),v100,z10,tGun\WObj:=wDoor;
    MoveL RelTool(S1,0,0,-80),v100,z10,tGun\WObj:=wDoor;
    MoveL RelTool(S2,0,5,-80\Rz:=30),v100,z10,tGun\WObj:=wDoor;
    MoveL Offs(RelTool(S1,0,0,-80),-1.094,39.985,-0.164),v100,z10,tGun\WObj:=wDoor;
    MoveL RelTool(Offs(S1,-1.068,0.176,49.988),0,0,-10),v100,z10,tGun\WObj:=wDoor;
    MoveL Offs([[107.692,-13.736,39.065],[0.9666066,0.0998563,-0.2087504,0.1101080],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],-2.135,0.352,99.977),v100,z10,tGun\WObj:=wDoor;
    SpotL S2,v800,gun1,sd1,tGun\WObj:=wDoor;
    MoveAbsJ jHome,v1000,fine,tGun;
  ENDPROC
ENDMODULE
