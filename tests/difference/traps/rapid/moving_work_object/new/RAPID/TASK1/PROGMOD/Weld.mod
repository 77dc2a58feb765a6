MODULE Weld
  CONST robtarget p10:=[[100,200,300],[0.5,0.5,0.5,0.5],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p20:=[[200,200,300],[0.5,0.5,0.5,0.5],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p30:=[[300,200,300],[0.5,0.5,0.5,0.5],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p40:=[[400,200,300],[0.5,0.5,0.5,0.5],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rWeld()
    MoveL p10,v200,z10,tGun\WObj:=wDoor;
    MoveL p20,v200,z10,tGun\WObj:=wDoor;
    MoveL p30,v200,z10,tGun\WObj:=wDoor;
    MoveL p40,v200,z10,tGun\WObj:=wDoor;
    MoveL p10,v5,fine,tGun\WObj:=wTurn;
  ENDPROC
ENDMODULE
