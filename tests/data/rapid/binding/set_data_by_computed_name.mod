MODULE m
  PERS robtarget pPick1:=[[1,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pPlace1:=[[2,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pPickFixed:=[[3,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    VAR robtarget pNew;
    SetDataVal "pPick"+NumToStr(n,0),pNew;
    MoveL pPick1,v100,z10,tGun\WObj:=wTable;
    MoveL pPlace1,v100,z10,tGun\WObj:=wTable;
    MoveL pPickFixed,v100,z10,tGun\WObj:=wTable;
  ENDPROC
ENDMODULE
