MODULE Weld
  CONST robtarget p10:=[[100,200,300],[0.5,0.5,0.5,0.5],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p20:=[[200,200,300],[0.5,0.5,0.5,0.5],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p30:=[[300,200,300],[0.5,0.5,0.5,0.5],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p40:=[[400,200,300],[0.5,0.5,0.5,0.5],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rWeld()
    MoveL Offs(p10,10,20,30),v200,z10,tGun\WObj:=wDoor;
    MoveL RelTool(p20,0,0,-50),v200,z10,tGun\WObj:=wDoor;
  ENDPROC
ENDMODULE
