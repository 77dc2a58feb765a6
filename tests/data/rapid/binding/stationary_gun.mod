MODULE m
  CONST robtarget p1:=[[11,22,33],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS wobjdata wHeldChanged:=[TRUE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PROC main()
    wHeldChanged.oframe.trans.x:=5;
    SpotL p1,v100,gun1,sdAny,tStand\WObj:=wPart;
    MoveL p1,v100,z10,tGun\WObj:=wPart;
    MoveL p1,v100,z10,tStand\WObj:=wTable;
    MoveL p1,v100,z10,tGun\WObj:=wTurn;
    MoveL p1,v100,z10,tStand\WObj:=wHeldChanged;
    MoveL p1,v100,z10,tGun\WObj:=wTable\TLoad:=loPart;
  ENDPROC
ENDMODULE
