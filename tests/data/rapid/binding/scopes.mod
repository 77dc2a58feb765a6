MODULE m
  LOCAL CONST robtarget p1:=[[1,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget p2:=[[2,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    CONST robtarget p2:=[[3,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    MoveL P1,v100,z10,tgun\WObj:=WTABLE;
    MoveL p2,v100,z10,tGun\WObj:=wTable;
  ENDPROC
  PROC other()
    MoveL p2,v100,z10,tGun\WObj:=wTable;
    MoveL p9,v100,z10,tNew\WObj:=wNew;
    MoveL p9,v100,z10,tGun\WObj:=wTable;
  ENDPROC
ENDMODULE
