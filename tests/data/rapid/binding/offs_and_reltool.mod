MODULE m
  CONST robtarget p1:=[[10,20,30],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveL Offs(p1,1,2,3),v100,z10,tGun\WObj:=wTable;
    MoveL RelTool(p1,0,0,-50\Rz:=90),v100,z10,tGun\WObj:=wTable;
    MoveL RelTool(p1,0,0,nUp),v100,z10,tGun\WObj:=wTable;
    MoveL Offs(Offs(p1,1,2,3),1,2,3),v100,z10,tGun\WObj:=wTable;
  ENDPROC
ENDMODULE
