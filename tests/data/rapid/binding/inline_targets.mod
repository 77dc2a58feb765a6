MODULE m
  PROC main()
    MoveJ [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun\WObj:=wTable;
    MoveC [[4,5,6],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[7,8,9],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun;
    MoveL [[1,2,3],oMine,[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun;
    MoveL [[1,2,3],[1,0,0,0],conf,extjoint0],v100,z10,tGun;
  ENDPROC
ENDMODULE
