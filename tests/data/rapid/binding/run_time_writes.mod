MODULE m
  PERS robtarget pSet:=[[1,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pPart:=[[2,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pCount:=[[3,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pNamed:=[[4,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pHanded:=[[5,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pStill:=[[6,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR robtarget vSomething:=[[7,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    VAR robtarget pStill;
    pSet:=CRobT(\Tool:=tGun\WObj:=wTable);
    pPart.trans.z:=5;
    Add pCount.trans.z,5;
    SetDataVal "pNamed",pSet;
    change pHanded;
    pStill:=pSet;
    go;
  ENDPROC
  PROC change(INOUT robtarget p)
    deeper p;
  ENDPROC
  PROC deeper(INOUT robtarget p)
    p.rot:=[0,1,0,0];
  ENDPROC
  PROC go()
    MoveL pSet,v100,z10,tGun\WObj:=wTable;
    MoveL pPart,v100,z10,tGun\WObj:=wTable;
    MoveL pCount,v100,z10,tGun\WObj:=wTable;
    MoveL pNamed,v100,z10,tGun\WObj:=wTable;
    MoveL pHanded,v100,z10,tGun\WObj:=wTable;
    MoveL pStill,v100,z10,tGun\WObj:=wTable;
    MoveL GetPlace(1),v100,z10,tGun\WObj:=wTable;
  ENDPROC
ENDMODULE
