MODULE Data
  TASK PERS tooldata tGun:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,0],[1,0,0,0],0,0,0]];
  TASK VAR clock c;
  LOCAL CONST num n:=3;
  PERS wobjdata mirror;
  VAR num cube{n,2*n,3};
  CONST num list{3}:=[1,2,3];
  VAR robtarget p10:=p20;
  VAR bool flag:=FALSE;
  PERS spotdata sd_wp432810:=[432810,1,1,1,1,-1];
ENDMODULE
