MODULE Weld
  CONST robtarget p10:=[[100,200,300],[0.5,0.5,0.5,0.5],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p20:=[[200,200,300],[0.5,0.5,0.5,0.5],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p30:=[[300,200,300],[0.5,0.5,0.5,0.5],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p40:=[[400,200,300],[0.5,0.5,0.5,0.5],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS gundata gun1:=["g",1];
  PERS spotdata sd_10:=[10,2400,1,0];
  PERS spotdata sd_20:=[20,2000,1,0];
  PROC rWeld()
    SpotL p10,vmax,gun1,sd_10,tGun\WObj:=wDoor;
    SpotL p20,vmax,sd_20,gun1,tGun\WObj:=wDoor;
  ENDPROC
ENDMODULE
